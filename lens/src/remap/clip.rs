//! Exact clipping of polygons against the unit cells of a grid, and moments of the pieces.

use nalgebra::Vector2;

/// A closed outline, not necessarily convex.
pub(crate) type Polygon = Vec<Vector2<f64>>;

/// Signed integrals over a polygon of 1, x, y and xy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    pub area: f64,
    pub x: f64,
    pub y: f64,
    pub xy: f64,
}

/// The moments of a polygon about `origin`, exact by Green's theorem.
pub(crate) fn moments(polygon: &[Vector2<f64>], origin: Vector2<f64>) -> Moments {
    let mut sum = Moments::default();
    let Some(last) = polygon.last() else { return sum };
    let mut p = last - origin;
    for q in polygon {
        let q = q - origin;
        let cross = p.x * q.y - q.x * p.y;
        sum.area += cross / 2.0;
        sum.x += cross * (p.x + q.x) / 6.0;
        sum.y += cross * (p.y + q.y) / 6.0;
        sum.xy += cross * (2.0 * p.x * p.y + p.x * q.y + q.x * p.y + 2.0 * q.x * q.y) / 24.0;
        p = q;
    }
    sum
}

/// Smallest and largest coordinates.
pub(crate) fn bounds(polygon: &[Vector2<f64>]) -> (Vector2<f64>, Vector2<f64>) {
    let inf = Vector2::repeat(f64::INFINITY);
    polygon.iter().fold((inf, -inf), |(low, high), p| (low.inf(p), high.sup(p)))
}

/// Cuts a polygon at the line `coordinate[axis] = at` (Sutherland and Hodgman, *Reentrant Polygon Clipping*,
/// CACM 17(1), 1974). Concave polygons get bridges along the line, which enclose nothing.
fn split(polygon: &[Vector2<f64>], axis: usize, at: f64, below: &mut Polygon, above: &mut Polygon) {
    below.clear();
    above.clear();
    let Some(mut p) = polygon.last().copied() else {
        return;
    };
    for &q in polygon {
        let (from, to) = (p[axis] - at, q[axis] - at);
        if from * to < 0.0 {
            let mut crossing = p + (q - p) * (from / (from - to));
            crossing[axis] = at;
            below.push(crossing);
            above.push(crossing);
        }
        if to <= 0.0 {
            below.push(q);
        }
        if to >= 0.0 {
            above.push(q);
        }
        p = q;
    }
}

/// Outlines may leave the image this far without counting as cut.
const ROUNDING_PX: f64 = 1e-6;

/// Buffers for clipping, kept from polygon to polygon.
#[derive(Default)]
pub(crate) struct Clipper {
    rows: Polygon,
    row: Polygon,
    columns: Polygon,
    cell: Polygon,
    spare: Polygon,
}

impl Clipper {
    /// Cuts `polygon` to [0, width] × [0, height]; says whether more than rounding was cut off.
    pub fn clip_to_image(&mut self, polygon: &mut Polygon, size_px: [u32; 2]) -> bool {
        let (low, high) = bounds(polygon);
        let mut cut = false;
        for axis in 0..2 {
            let side = f64::from(size_px[axis]);
            if low[axis] < 0.0 {
                split(polygon, axis, 0.0, &mut self.spare, &mut self.cell);
                std::mem::swap(polygon, &mut self.cell);
            }
            if high[axis] > side {
                split(polygon, axis, side, &mut self.cell, &mut self.spare);
                std::mem::swap(polygon, &mut self.cell);
            }
            cut |= low[axis] < -ROUNDING_PX || high[axis] > side + ROUNDING_PX;
        }
        cut
    }

    /// Calls `visit` with the index of every unit cell [x, x+1] × [y, y+1] that `polygon` may touch and its piece in
    /// there. The pieces' moments add up to the polygon's.
    pub fn for_each_cell(
        &mut self,
        polygon: &[Vector2<f64>],
        mut visit: impl FnMut(i64, i64, &[Vector2<f64>]),
    ) {
        if polygon.len() < 3 {
            return;
        }
        let (y0, y1) = cells(polygon, 1);
        let (x0, x1) = cells(polygon, 0);
        if y0 == y1 && x0 == x1 {
            visit(x0, y0, polygon);
            return;
        }
        self.rows.clear();
        self.rows.extend_from_slice(polygon);
        for y in y0..=y1 {
            if y < y1 {
                split(&self.rows, 1, (y + 1) as f64, &mut self.row, &mut self.spare);
                std::mem::swap(&mut self.rows, &mut self.spare);
            } else {
                std::mem::swap(&mut self.rows, &mut self.row);
            }
            if self.row.len() < 3 {
                continue;
            }
            let (x0, x1) = cells(&self.row, 0);
            std::mem::swap(&mut self.row, &mut self.columns);
            for x in x0..x1 {
                split(&self.columns, 0, (x + 1) as f64, &mut self.cell, &mut self.spare);
                std::mem::swap(&mut self.columns, &mut self.spare);
                visit(x, y, &self.cell);
            }
            visit(x1, y, &self.columns);
        }
    }
}

/// The first and last cell that a polygon touches along an axis.
fn cells(polygon: &[Vector2<f64>], axis: usize) -> (i64, i64) {
    let (low, high) = bounds(polygon);
    let first = low[axis].floor() as i64;
    (first, (high[axis].ceil() as i64 - 1).max(first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn moments_of_a_rectangle() {
        let rectangle = [(1.0, 2.0), (3.0, 2.0), (3.0, 5.0), (1.0, 5.0)].map(|(x, y)| Vector2::new(x, y));
        let m = moments(&rectangle, Vector2::zeros());
        // ∫x = 4·3, ∫y = 10.5·2, ∫xy = 4·10.5
        assert_eq!(m, Moments { area: 6.0, x: 12.0, y: 21.0, xy: 42.0 });
    }

    proptest! {
        /// Pieces of any polygon, also self-crossing ones, lie in their cell and add up to the whole.
        #[test]
        fn pieces_add_up(points in prop::collection::vec((-3.0..4.0_f64, -3.0..4.0_f64), 3..12)) {
            let polygon: Polygon = points.iter().map(|&(x, y)| Vector2::new(x, y)).collect();
            let mut sum = Moments::default();
            Clipper::default().for_each_cell(&polygon, |x, y, piece| {
                let low = Vector2::new(x as f64, y as f64);
                for p in piece {
                    assert!((p - low).min() >= -1e-12 && (p - low).max() <= 1.0 + 1e-12);
                }
                let m = moments(piece, Vector2::zeros());
                sum.area += m.area;
                sum.x += m.x;
                sum.y += m.y;
                sum.xy += m.xy;
            });
            let whole = moments(&polygon, Vector2::zeros());
            for (a, b) in [(sum.area, whole.area), (sum.x, whole.x), (sum.y, whole.y), (sum.xy, whole.xy)] {
                prop_assert!((a - b).abs() < 1e-9, "{sum:?} {whole:?}");
            }
        }
    }
}
