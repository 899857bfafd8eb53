//! Black shapes on white paper: what every kind of output draws.

/// A sheet. Places are millimetres right and down from the paper's upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// What it is, for the file's title.
    pub title: String,
    /// Width and height of the paper.
    pub size_mm: [f64; 2],
    /// Everything black.
    pub paths: Vec<Path>,
}

/// A black shape: all that its contours wind around (the non-zero rule). Holes wind the other way.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Such as `tag36h11 7` or `ruler`; for text, the text.
    pub name: String,
    /// Its outlines.
    pub contours: Vec<Contour>,
}

/// A closed outline.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// Where it begins and ends.
    pub start_mm: [f64; 2],
    /// Its pieces; the last is joined to the start by a line.
    pub segments: Vec<Segment>,
}

/// A piece of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// A straight line to a point.
    Line([f64; 2]),
    /// A quadratic Bézier curve: its control point, and its end.
    Quadratic([f64; 2], [f64; 2]),
}

impl Segment {
    /// Where it ends.
    pub fn end_mm(&self) -> [f64; 2] {
        match *self {
            Self::Line(end) | Self::Quadratic(_, end) => end,
        }
    }
}

impl Contour {
    /// A polygon; nothing without corners.
    pub(super) fn polygon(corners_mm: &[[f64; 2]]) -> Option<Self> {
        let (start_mm, rest) = corners_mm.split_first()?;
        Some(Self { start_mm: *start_mm, segments: rest.iter().copied().map(Segment::Line).collect() })
    }

    /// A rectangle between two corners, clockwise as seen.
    pub(super) fn rectangle([x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) -> Self {
        Self { start_mm: [x0, y0], segments: [[x1, y0], [x1, y1], [x0, y1]].map(Segment::Line).to_vec() }
    }

    /// All its points, control points of curves too.
    pub fn points_mm(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let points = self.segments.iter().flat_map(|segment| match *segment {
            Segment::Line(end) => [end, end],
            Segment::Quadratic(control, end) => [control, end],
        });
        std::iter::once(self.start_mm).chain(points)
    }
}

impl Path {
    /// Smallest and largest coordinates of its points; `None` for nothing.
    pub fn bounds_mm(&self) -> Option<[[f64; 2]; 2]> {
        let mut points = self.contours.iter().flat_map(Contour::points_mm);
        let first = points.next()?;
        let grown = |[low, high]: [[f64; 2]; 2], [x, y]: [f64; 2]| {
            [[low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]]
        };
        Some(points.fold([first; 2], grown))
    }
}
