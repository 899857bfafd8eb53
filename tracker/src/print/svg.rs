//! Drawings as SVG 1.1, in millimetres.

use std::fmt::Write as _;

use super::drawing::{Contour, Drawing, Path, Segment};

impl Drawing {
    /// The text of an SVG file whose user unit is a millimetre.
    pub fn to_svg(&self) -> String {
        let [width, height] = self.size_mm.map(number);
        let mut svg = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" \
             height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n<rect width=\"{width}\" \
             height=\"{height}\" fill=\"#fff\"/>\n",
            escaped(&self.title)
        );
        for path in &self.paths {
            // Crisp edges would spoil letters.
            let rendering = if path.is_straight() { " shape-rendering=\"crispEdges\"" } else { "" };
            let data: Vec<String> = path.contours.iter().map(contour).collect();
            let _ = writeln!(
                svg,
                "<path aria-label=\"{}\"{rendering} d=\"{}\"/>",
                escaped(&path.name),
                data.join(" ")
            );
        }
        svg + "</svg>\n"
    }
}

impl Path {
    fn is_straight(&self) -> bool {
        let straight = |segment: &Segment| matches!(segment, Segment::Line(_));
        self.contours.iter().all(|contour| contour.segments.iter().all(straight))
    }
}

fn contour(contour: &Contour) -> String {
    let mut data = format!("M{}", point(contour.start_mm));
    for segment in &contour.segments {
        match *segment {
            Segment::Line(end) => data += &format!("L{}", point(end)),
            Segment::Quadratic(control, end) => data += &format!("Q{} {}", point(control), point(end)),
        }
    }
    data + "Z"
}

fn point([x, y]: [f64; 2]) -> String {
    format!("{} {}", number(x), number(y))
}

/// To 10 nanometres.
fn number(value: f64) -> String {
    ((value * 1e5).round() / 1e5 + 0.0).to_string()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
