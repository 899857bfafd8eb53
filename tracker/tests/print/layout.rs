//! Where things are on the paper.

use coshade_tracker::print::{Paper, Path, PrintError, PrintSpec, Sheet};
use coshade_tracker::{Board, Family, tag_bitmap};

use crate::{desk_board, paper, squares_mm};

#[test]
fn the_board_of_the_desk_is_printed() {
    let desk = Board::parse(include_str!("../../../worlds/board.toml"), "worlds/board.toml").unwrap();
    let sheet = Sheet::new(&desk_board()).unwrap();
    assert_eq!(sheet.board.family, desk.family);
    assert_eq!(sheet.board.tags, desk.tags);
    assert_eq!((sheet.ruler_mm, sheet.upright_ruler_mm), (100.0, Some(100.0)));
    // On upright paper the upright ruler is under the board: (297 − 26 − 155) / 2 mm high, in whole centimetres.
    let upright = Sheet::new(&PrintSpec { paper: paper("a4"), ..desk_board() }).unwrap();
    assert_eq!((upright.ruler_mm, upright.upright_ruler_mm), (100.0, Some(50.0)));
    assert_eq!(upright.board.tags, desk.tags);
    // Rings of 5.125 mm fill the gaps of 11 mm up to 0.75 mm.
    assert!(!sheet.has_labels);
}

/// Area of all contours, the way they wind.
fn area_mm2(path: &Path) -> f64 {
    let doubled = |contour: &coshade_tracker::print::Contour| {
        let points: Vec<[f64; 2]> =
            std::iter::once(contour.start_mm).chain(contour.segments.iter().map(|s| s.end_mm())).collect();
        let next = points.iter().cycle().skip(1);
        points.iter().zip(next).map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>()
    };
    path.contours.iter().map(doubled).sum::<f64>() / 2.0
}

#[test]
fn tags_are_where_the_board_says_and_as_large() {
    for family in Family::ALL {
        let spec =
            PrintSpec { family, ids: vec![3, 1, 8, 0, 2, 7], columns: 3, gap_mm: None, ..desk_board() };
        let spec = PrintSpec { size_mm: 22.0, ..spec };
        let sheet = Sheet::new(&spec).unwrap();
        assert_eq!(sheet.board.tags.iter().map(|tag| tag.id).collect::<Vec<_>>(), spec.ids);
        let tags = sheet.drawing.paths.iter().zip(squares_mm(&sheet)).zip(&spec.ids);
        for ((path, [low, high]), id) in tags {
            assert_eq!(path.name, format!("{family} {id}"));
            let bitmap = tag_bitmap(family, *id).unwrap();
            let cell = (high[0] - low[0]) / f64::from(bitmap.cells_between_corners);
            let black = bitmap.white.iter().zip(&bitmap.known).filter(|(white, known)| **known && !**white);
            let expected = black.count() as f64 * cell * cell;
            assert!((area_mm2(path) - expected).abs() < 1e-6 * expected, "{} {expected}", area_mm2(path));
            let reach = f64::from((bitmap.cells - bitmap.cells_between_corners) / 2) * cell;
            let [drawn_low, drawn_high] = path.bounds_mm().unwrap();
            for axis in 0..2 {
                if family == Family::Tag36h11 {
                    // The border is the square through the corners. Board files hold whole nanometres.
                    assert!((drawn_low[axis] - low[axis]).abs() < 2e-6, "{drawn_low:?} {low:?}");
                    assert!((drawn_high[axis] - high[axis]).abs() < 2e-6, "{drawn_high:?} {high:?}");
                }
                assert!(drawn_low[axis] > low[axis] - reach - 2e-6);
                assert!(drawn_high[axis] < high[axis] + reach + 2e-6);
            }
        }
    }
}

/// Numbers of a sequence that looks random (Knuth's MMIX).
struct Sequence(u64);

impl Sequence {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }

    fn spec(&mut self) -> PrintSpec {
        let [columns, rows] = [self.below(5) + 1, self.below(5) + 1];
        let family = Family::ALL[self.below(8) as usize];
        let count = (columns * rows).min(u64::from(family.tag_count())) / columns * columns;
        let size_mm = 4.0 + self.below(800) as f64 / 10.0;
        let first = self.below(u64::from(family.tag_count()) - count + 1);
        let papers = ["a4", "a3", "letter", "fit", "a2", "150x90"];
        PrintSpec {
            family,
            ids: (first..first + count).map(|id| id as u32).collect(),
            columns: columns as usize,
            size_mm,
            gap_mm: (self.below(2) == 0).then(|| size_mm * self.below(200) as f64 / 100.0),
            paper: paper(papers[self.below(6) as usize]),
            margin_mm: self.below(12) as f64,
            labels: self.below(4) > 0,
            px_per_m: (self.below(2) == 0).then_some(23622),
        }
    }
}

#[test]
fn white_rings_and_margins_stay_white() {
    let mut sequence = Sequence(1);
    let (mut printed, mut labelled) = (0, 0);
    for number in 0..600 {
        let spec = sequence.spec();
        let sheet = match Sheet::new(&spec) {
            Ok(sheet) => sheet,
            Err(PrintError::DoesNotFit(_) | PrintError::Gap { .. } | PrintError::Coarse { .. }) => continue,
            Err(error) => panic!("{number}: {error}"),
        };
        printed += 1;
        labelled += u32::from(sheet.has_labels);
        let bitmap = tag_bitmap(spec.family, spec.ids[0]).unwrap();
        let cell = sheet.grid.size_mm / f64::from(bitmap.cells_between_corners);
        // One white cell around the black border of classic tags, and around the bits of the others.
        let outside = f64::from((bitmap.cells - bitmap.cells_between_corners) / 2);
        let ring = if outside == 1.0 { cell } else { (outside + 1.0) * cell };
        for (index, path) in sheet.drawing.paths.iter().enumerate() {
            let Some([low, high]) = path.bounds_mm() else { continue };
            for axis in 0..2 {
                let end = sheet.drawing.size_mm[axis] - spec.margin_mm;
                let in_margin = low[axis] < spec.margin_mm - 0.03 || high[axis] > end + 0.03;
                assert!(!in_margin, "{number}: {} in the margin: {low:?} {high:?}\n{spec:?}", path.name);
            }
            for (other, [from, to]) in squares_mm(&sheet).into_iter().enumerate() {
                let clear = (0..2).any(|axis| {
                    high[axis] <= from[axis] - ring + 1e-5 || low[axis] >= to[axis] + ring - 1e-5
                });
                assert!(clear || other == index, "{number}: {} in the ring of {other}\n{spec:?}", path.name);
            }
        }
    }
    assert!(printed > 150 && labelled > 50, "{printed} {labelled}");
}

#[test]
fn what_does_not_fit_is_told_with_what_would() {
    let spec = PrintSpec { ids: (0..36).collect(), columns: 6, gap_mm: None, size_mm: 30.0, ..desk_board() };
    let upright = PrintSpec { paper: paper("a4"), ..spec };
    let told = Sheet::new(&upright).unwrap_err().to_string();
    assert!(told.contains("225.0 × 225.0 mm do not fit a4"), "{told}");
    assert!(told.contains("17.5 mm too wide"), "{told}");
    assert!(told.contains("it fits on a3, or with a size of 27.5 mm"), "{told}");
    assert!(Sheet::new(&PrintSpec { size_mm: 27.5, ..upright.clone() }).is_ok());
    assert!(Sheet::new(&PrintSpec { size_mm: 27.6, ..upright.clone() }).is_err());
    assert!(Sheet::new(&PrintSpec { paper: paper("a3"), ..upright }).is_ok());

    let wide =
        PrintSpec { size_mm: 60.0, gap_mm: Some(20.0), ids: vec![0, 1, 2], columns: 3, ..desk_board() };
    let told = Sheet::new(&PrintSpec { paper: paper("letter"), ..wide.clone() }).unwrap_err().to_string();
    assert!(told.contains("it fits in landscape, or with a size of "), "{told}");
    assert!(told.ends_with(" mm") && told.contains(" and a gap of "), "{told}");
    assert!(Sheet::new(&PrintSpec { paper: paper("letter").landscape(), ..wide }).is_ok());
}

#[test]
fn mistakes_are_told() {
    let told = |spec: PrintSpec| Sheet::new(&spec).unwrap_err().to_string();
    let spec = desk_board;
    for (spec, message) in [
        (PrintSpec { ids: vec![], ..spec() }, "no tags"),
        (PrintSpec { columns: 0, ..spec() }, "no tags"),
        (PrintSpec { columns: 5, ..spec() }, "12 tags make no full rows of 5"),
        (PrintSpec { ids: vec![587], columns: 1, ..spec() }, "tag36h11 has no tag 587: allowed are 0 to 586"),
        (PrintSpec { ids: vec![4, 4], columns: 1, ..spec() }, "tag 4 is there twice"),
        (PrintSpec { ids: (0..5000).collect(), ..spec() }, "5000 tags"),
        (PrintSpec { size_mm: f64::NAN, ..spec() }, "size: NaN is out of range"),
        (PrintSpec { size_mm: 0.0, ..spec() }, "size: 0 is out of range"),
        (PrintSpec { gap_mm: Some(f64::INFINITY), ..spec() }, "gap: inf is out of range"),
        (PrintSpec { margin_mm: -1.0, ..spec() }, "margin: -1 is out of range"),
        (PrintSpec { px_per_m: Some(10), ..spec() }, "pixels per metre: 10 is out of range"),
        // 2 of 8 cells of 41 mm are 10.25 mm.
        (PrintSpec { gap_mm: Some(10.2), ..spec() }, "a gap of 10.25 mm at least"),
        // Bits reach 2 cells beyond a border of 5, and a ring around them: 6 of 5 cells of 40 mm.
        (
            PrintSpec { family: Family::Standard41h12, size_mm: 40.0, ..spec() },
            "for tagStandard41h12 of 40 mm is a gap of 48 mm at least",
        ),
        (PrintSpec { px_per_m: Some(1000), size_mm: 12.0, ..spec() }, "choose a size of 8 or 16 mm"),
        (PrintSpec { paper: paper("40x200"), ids: vec![0], columns: 1, ..spec() }, "holds no ruler"),
        (PrintSpec { margin_mm: 100.0, ..spec() }, "room for"),
        (
            PrintSpec { size_mm: 2000.0, gap_mm: None, paper: Paper::Fit, ..spec() },
            "paper: 10021 is out of range",
        ),
    ] {
        let told = told(spec);
        assert!(told.contains(message), "{message} in: {told}");
    }
    let least = PrintSpec { gap_mm: Some(10.25), ..desk_board() };
    assert!(Sheet::new(&least).is_ok());
}

#[test]
fn paper_that_fits_is_as_large_as_needed() {
    let spec = PrintSpec { paper: Paper::Fit, ids: vec![7], columns: 1, ..desk_board() };
    let sheet = Sheet::new(&spec).unwrap();
    assert_eq!((sheet.ruler_mm, sheet.has_labels), (100.0, true));
    let large = PrintSpec { size_mm: 500.0, gap_mm: None, ids: vec![7, 8], columns: 2, ..spec };
    let sheet = Sheet::new(&large).unwrap();
    // Two tags of 8 cells, each with a ring of one: 20 cells of 62.5 mm, margins, and the upright ruler of 11 mm.
    assert_eq!(sheet.drawing.size_mm[0], 1250.0 + 10.0 + 11.0);
    assert_eq!(sheet.upright_ruler_mm, Some(100.0));
}
