//! Drawings as PDF, in vectors.

use pdf_writer::{Content, Finish, Name, Pdf, Rect, Ref, TextStr};

use super::PROGRAM;
use super::drawing::{Contour, Drawing, Segment};

const POINTS_PER_MM: f64 = 72.0 / 25.4;

impl Drawing {
    /// The bytes of a PDF file of one page, which asks viewers to print it without scaling.
    pub fn to_pdf(&self) -> Vec<u8> {
        let [catalog, pages, page, content, info] = [1, 2, 3, 4, 5].map(Ref::new);
        let [width, height] = self.size_mm.map(|side| (side * POINTS_PER_MM) as f32);
        let mut pdf = Pdf::new();
        let mut root = pdf.catalog(catalog);
        root.pages(pages);
        root.viewer_preferences().pair(Name(b"PrintScaling"), Name(b"None"));
        root.finish();
        pdf.pages(pages).kids([page]).count(1);
        let mut sheet = pdf.page(page);
        sheet.media_box(Rect::new(0.0, 0.0, width, height)).parent(pages).contents(content);
        sheet.resources();
        sheet.finish();
        pdf.document_info(info).title(TextStr(&self.title)).producer(TextStr(PROGRAM));
        pdf.stream(content, &self.content());
        pdf.finish()
    }

    fn content(&self) -> Vec<u8> {
        let mut content = Content::new();
        // From millimetres down from the upper edge to points up from the lower one.
        let scale = POINTS_PER_MM as f32;
        content.transform([scale, 0.0, 0.0, -scale, 0.0, (self.size_mm[1] * POINTS_PER_MM) as f32]);
        content.set_fill_gray(0.0);
        for path in self.paths.iter().filter(|path| !path.contours.is_empty()) {
            for contour in &path.contours {
                draw(&mut content, contour);
            }
            content.fill_nonzero();
        }
        content.finish().to_vec()
    }
}

fn draw(content: &mut Content, contour: &Contour) {
    let mut here = contour.start_mm;
    let [x, y] = here.map(|place| place as f32);
    content.move_to(x, y);
    for segment in &contour.segments {
        let [x, y] = segment.end_mm().map(|place| place as f32);
        match *segment {
            Segment::Line(_) => content.line_to(x, y),
            Segment::Quadratic(control, end) => {
                let [[x1, y1], [x2, y2]] = [here, end].map(|point| toward(control, point));
                content.cubic_to(x1, y1, x2, y2, x, y)
            }
        };
        here = segment.end_mm();
    }
    content.close_path();
}

/// The control point of the same curve as a cubic: two thirds of the way from an end to the quadratic's.
fn toward([control_x, control_y]: [f64; 2], [x, y]: [f64; 2]) -> [f32; 2] {
    [(x + 2.0 * control_x) / 3.0, (y + 2.0 * control_y) / 3.0].map(|place| place as f32)
}
