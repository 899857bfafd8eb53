//! PDF, SVG and PNG against the drawing and the board.

use coshade_tracker::print::{Drawing, PrintError, PrintSpec, Segment, Sheet};
use coshade_tracker::{Family, tag_bitmap};

use crate::{desk_board, paper, squares_mm};

/// Sheets of every family, on several papers, with curves (text) and straight shapes.
fn sheets() -> Vec<Sheet> {
    let spec = |family| PrintSpec {
        family,
        ids: vec![0, 5, 9, 2],
        columns: 2,
        size_mm: 23.7,
        gap_mm: None,
        paper: paper("a4"),
        ..desk_board()
    };
    Family::ALL.iter().map(|family| Sheet::new(&spec(*family)).unwrap()).collect()
}

/// Points of all contours in order, control points of curves too.
fn points_mm(drawing: &Drawing) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for contour in drawing.paths.iter().flat_map(|path| &path.contours) {
        points.push(contour.start_mm);
        for segment in &contour.segments {
            match *segment {
                Segment::Line(end) => points.push(end),
                Segment::Quadratic(control, end) => points.extend([control, end]),
            }
        }
    }
    points
}

fn assert_near(found: &[[f64; 2]], expected: &[[f64; 2]], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        let distance = (found[0] - expected[0]).hypot(found[1] - expected[1]);
        assert!(distance < tolerance, "{found:?} instead of {expected:?}");
    }
}

#[test]
fn svg_says_what_is_drawn() {
    for sheet in sheets() {
        let svg = sheet.drawing.to_svg();
        assert!(svg.contains("width=\"210mm\" height=\"297mm\" viewBox=\"0 0 210 297\""), "{}", &svg[..300]);
        let mut points = Vec::new();
        for data in svg.split(" d=\"").skip(1) {
            let data = data.split('"').next().unwrap();
            let numbers =
                data.split(|c: char| c.is_ascii_alphabetic() || c == ' ').filter(|part| !part.is_empty());
            let numbers: Vec<f64> = numbers.map(|number| number.parse().unwrap()).collect();
            points.extend(numbers.chunks(2).map(|point| [point[0], point[1]]));
        }
        // Five decimals.
        assert_near(&points, &points_mm(&sheet.drawing), 0.8e-5);
        // Crisp edges for all but letters.
        let straight = svg.matches("crispEdges").count();
        let letters = svg.lines().filter(|line| line.contains(" d=\"") && line.contains('Q')).count();
        assert_eq!(straight + letters, svg.matches("<path").count());
        assert!(straight >= 4 + 2, "tags and rulers");
    }
}

#[test]
fn svg_names_are_escaped() {
    let mut drawing = Sheet::new(&desk_board()).unwrap().drawing;
    drawing.title = "a<b & \"c\"".to_owned();
    assert!(drawing.to_svg().contains("<title>a&lt;b &amp; &quot;c&quot;</title>"));
}

/// Numbers and operators of a PDF's only stream.
fn content(pdf: &[u8]) -> String {
    let text = String::from_utf8_lossy(pdf).into_owned();
    let (_, rest) = text.split_once("stream\n").unwrap();
    rest.split_once("endstream").unwrap().0.to_owned()
}

#[test]
fn pdf_says_what_is_drawn() {
    for sheet in sheets() {
        let pdf = sheet.drawing.to_pdf();
        let text = String::from_utf8_lossy(&pdf).into_owned();
        assert!(text.contains("/PrintScaling /None"));
        let media = text.split_once("/MediaBox [").unwrap().1.split(']').next().unwrap();
        let media: Vec<f64> = media.split_whitespace().map(|number| number.parse().unwrap()).collect();
        assert_near(&[[media[2], media[3]]], &[[210.0 / 25.4 * 72.0, 297.0 / 25.4 * 72.0]], 1e-4);
        let mut points = Vec::new();
        let (mut numbers, mut matrix): (Vec<f64>, Vec<f64>) = Default::default();
        for word in content(&pdf).split_whitespace() {
            match word {
                "cm" => matrix = std::mem::take(&mut numbers),
                "m" | "l" => points.push([numbers[0], numbers[1]]),
                "c" => {
                    let from: [f64; 2] = *points.last().unwrap();
                    let [x1, y1, x2, y2, x, y] = *numbers else { panic!("{numbers:?}") };
                    // The quadratic's control point, from either of the cubic's.
                    let first = [(3.0 * x1 - from[0]) / 2.0, (3.0 * y1 - from[1]) / 2.0];
                    let second = [(3.0 * x2 - x) / 2.0, (3.0 * y2 - y) / 2.0];
                    assert_near(&[first], &[second], 2e-4);
                    points.extend([first, [x, y]]);
                }
                "f" | "g" | "h" => {}
                number => {
                    numbers.push(number.parse().unwrap());
                    continue;
                }
            }
            numbers.clear();
        }
        let points: Vec<[f64; 2]> = points
            .iter()
            .map(|[x, y]| [0, 1].map(|a| matrix[a] * x + matrix[a + 2] * y + matrix[a + 4]))
            .map(|[x, y]| [x / 72.0 * 25.4, 297.0 - y / 72.0 * 25.4])
            .collect();
        // Numbers are of single precision: 297 mm have a step of 3e-5 mm.
        assert_near(&points, &points_mm(&sheet.drawing), 1e-4);
    }
}

#[test]
fn cross_references_of_a_pdf_lead_to_its_objects() {
    let pdf = Sheet::new(&desk_board()).unwrap().drawing.to_pdf();
    let text = String::from_utf8_lossy(&pdf);
    let start: usize = text.rsplit_once("startxref\n").unwrap().1.lines().next().unwrap().parse().unwrap();
    assert!(pdf[start..].starts_with(b"xref\n0 6\n"));
    let table = std::str::from_utf8(&pdf[start..]).unwrap();
    for (number, line) in table.lines().skip(3).take(5).enumerate() {
        let offset: usize = line[..10].parse().unwrap();
        assert!(pdf[offset..].starts_with(format!("{} 0 obj", number + 1).as_bytes()), "{line}");
    }
}

/// Width, height, grey levels and pixels per metre.
pub fn decoded(file: &[u8]) -> (usize, usize, Vec<u8>, u32) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    let mut levels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut levels).unwrap();
    assert_eq!((frame.color_type, frame.bit_depth), (png::ColorType::Grayscale, png::BitDepth::Eight));
    let dims = reader.info().pixel_dims.unwrap();
    assert_eq!((dims.unit, dims.xppu), (png::Unit::Meter, dims.yppu));
    (frame.width as usize, frame.height as usize, levels, dims.xppu)
}

#[test]
fn png_has_whole_pixels_where_the_board_says() {
    for family in Family::ALL {
        // 300 dpi: no size in millimetres is whole pixels.
        let spec = PrintSpec {
            family,
            ids: vec![0, 5, 9, 2],
            columns: 2,
            size_mm: 23.7,
            gap_mm: None,
            paper: paper("a4"),
            px_per_m: Some(11811),
            ..desk_board()
        };
        let sheet = Sheet::new(&spec).unwrap();
        let (width, height, levels, px_per_m) = decoded(&sheet.drawing.to_png(11811).unwrap());
        assert_eq!((width, height, px_per_m), (2480, 3508, 11811));
        assert!((sheet.grid.size_mm / spec.size_mm - 1.0).abs() < 0.05);
        for (id, [low, high]) in spec.ids.iter().zip(squares_mm(&sheet)) {
            let bitmap = tag_bitmap(family, *id).unwrap();
            let [left, top, right, bottom] = [low[0], low[1], high[0], high[1]].map(|place| place * 11.811);
            // Whole pixels, up to the whole nanometres of the board file.
            assert!((left - left.round()).abs() < 1e-4 && (bottom - bottom.round()).abs() < 1e-4);
            let cell = (right - left) / f64::from(bitmap.cells_between_corners);
            assert!((cell - cell.round()).abs() < 1e-4, "{cell}");
            assert!((bottom - top - (right - left)).abs() < 1e-4);
            let (cell, left, top) = (cell.round() as usize, left.round() as usize, top.round() as usize);
            let outside = ((bitmap.cells - bitmap.cells_between_corners) / 2) as usize;
            for row in 0..bitmap.cells as usize * cell {
                for column in 0..bitmap.cells as usize * cell {
                    let (x, y) = (left + column - outside * cell, top + row - outside * cell);
                    let index = row / cell * bitmap.cells as usize + column / cell;
                    let black = bitmap.known[index] && !bitmap.white[index];
                    let expected = if black { 0 } else { 255 };
                    assert_eq!(levels[y * width + x], expected, "{family} {id}: cell {index}, pixel {x} {y}");
                }
            }
        }
    }
}

#[test]
fn png_is_black_by_the_share_that_is_covered() {
    // Total ink of a picture is the area of its shapes, wherever edges are: 254 dpi is 10 pixels a millimetre, and
    // nothing is rounded to it.
    for sheet in sheets() {
        let (.., levels, _) = decoded(&sheet.drawing.to_png(10_000).unwrap());
        let ink_mm2: f64 = levels.iter().map(|level| f64::from(255 - level) / 255.0).sum::<f64>() / 100.0;
        let area_mm2: f64 = sheet.drawing.paths.iter().flat_map(|path| &path.contours).map(area_mm2).sum();
        // Each of some 1e4 edge pixels is rounded to 1/255: 1e-2 · √1e4 / 255 mm² at most, with curves of letters flattened.
        assert!((ink_mm2 - area_mm2.abs()).abs() < 2e-3 * ink_mm2, "{ink_mm2} {area_mm2}");
    }
}

/// By Green's theorem; exact for lines and quadratic curves.
fn area_mm2(contour: &coshade_tracker::print::Contour) -> f64 {
    let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - b[0] * a[1];
    let mut here = contour.start_mm;
    let mut doubled = 0.0;
    for segment in &contour.segments {
        doubled += match *segment {
            Segment::Line(end) => cross(here, end),
            Segment::Quadratic(control, end) => {
                (2.0 * cross(here, control) + 2.0 * cross(control, end) + cross(here, end)) / 3.0
            }
        };
        here = segment.end_mm();
    }
    (doubled + cross(here, contour.start_mm)) / 2.0
}

#[test]
fn images_that_are_too_large_are_refused() {
    let spec = PrintSpec { paper: paper("a0"), px_per_m: Some(400_000), ..desk_board() };
    let error = Sheet::new(&spec).unwrap().drawing.to_png(400_000).unwrap_err();
    assert_eq!(error, PrintError::TooLarge { width: 336_400, height: 475_600 });
}
