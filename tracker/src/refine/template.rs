//! What a tag looks like through a blur: its cells convolved with a Gaussian of any covariance.
//!
//! A Gaussian blur of the image is, on the tag, a Gaussian whose covariance follows the tilt. Without correlation it blurs
//! along rows and columns of cells: differences of normal distributions. Correlation ρ is added by Mehler's series, whose
//! n-th term is ρⁿ/n! times the n-th derivatives along both axes, in units of the standard deviations: three terms. It
//! matters only where edges meet.

use nalgebra::{Matrix2, Vector2};

use super::gaussian::normal;
use crate::bitmap::{TagBitmap, TagError, tag_bitmap};
use crate::detection::TagId;

/// Widest blur that is evaluated, in cells: under a wider one a tag cannot be read.
const MAX_SIGMA: f64 = 1.0;
/// Most cells within its reach.
const MAX_CELLS: usize = 8;
/// How far the blur is followed, in standard deviations.
const REACH: f64 = 3.5;
/// Narrowest blur that is evaluated, in cells: below it, edges are steps to the precision needed.
const MIN_SIGMA: f64 = 1e-3;

/// The cells of one tag.
#[derive(Clone, Debug)]
pub(crate) struct Template {
    /// Cells along each side.
    cells: usize,
    /// From the side of the bitmap to the square through the corners, in cells.
    margin: f64,
    /// 1 for white, 0 for black, row by row.
    white: Vec<f64>,
    /// 1 where the tag says what is printed, 0 elsewhere and in a ring of cells around it, row by row.
    known: Vec<f64>,
    /// Whether that is so in all of its cells.
    all_known: bool,
}

/// The blurred tag at one place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shade {
    /// 0 black, 1 white.
    pub(super) value: f64,
    /// ∂value/∂(column, row), per cell.
    pub(super) gradient: Vector2<f64>,
    /// ∂value/∂ ln(standard deviation of the blur).
    pub(super) by_log_blur: f64,
}

impl Template {
    pub(crate) fn new(tag: TagId) -> Result<Self, TagError> {
        let TagBitmap { cells, cells_between_corners, white, known } = tag_bitmap(tag.family, tag.id)?;
        let white = white.iter().map(|white| f64::from(u8::from(*white))).collect();
        let margin = 0.5 * f64::from(cells - cells_between_corners);
        let cells = cells as usize;
        let all_known = known.iter().all(|known| *known);
        let mut ringed = vec![0.0; (cells + 2) * (cells + 2)];
        for (index, known) in known.into_iter().enumerate() {
            if let Some(cell) = ringed.get_mut((index / cells + 1) * (cells + 2) + index % cells + 1) {
                *cell = f64::from(u8::from(known));
            }
        }
        Ok(Self { cells, margin, white, known: ringed, all_known })
    }

    /// The corners in the order of [`crate::detection::UNIT_CORNERS`], as columns and rows of cells.
    pub(super) fn corners(&self) -> [Vector2<f64>; 4] {
        let (low, high) = (self.margin, self.cells as f64 - self.margin);
        [Vector2::new(low, high), Vector2::new(high, high), Vector2::new(high, low), Vector2::new(low, low)]
    }

    /// Cells between the corners.
    pub(super) fn width(&self) -> f64 {
        self.cells as f64 - 2.0 * self.margin
    }

    /// Cells along each side of the whole.
    pub(super) fn side(&self) -> f64 {
        self.cells as f64
    }

    /// How much of what a blur brings to a `place` comes from where anything may be printed: 0 nothing, 1 all. The blur's
    /// standard deviations are along columns and rows.
    pub(super) fn unknown(&self, place: Vector2<f64>, sigma: Vector2<f64>) -> f64 {
        let deep =
            |place: f64, sigma: f64| place > REACH * sigma && place < self.cells as f64 - REACH * sigma;
        if self.all_known && deep(place.x, sigma.x) && deep(place.y, sigma.y) {
            return 0.0;
        }
        1.0 - blurred(&self.known, self.cells + 2, place + Vector2::repeat(1.0), sigma, 0.0).value
    }

    /// Whether an edge between black and white is within `reach` of a place, along the rows or along the columns.
    pub(super) fn is_near_edge(&self, place: Vector2<f64>, reach: Vector2<f64>) -> bool {
        let differ = |a: [f64; 2], b: [f64; 2]| self.color(a) != self.color(b);
        let (x, y) = (place.x, place.y);
        // Places on a tag are not below 0 by more than a cell: a cast rounds down what is a cell higher.
        let nearest = |x: f64| f64::from((x + 1.5) as i32 - 1);
        let (column, row) = (nearest(x), nearest(y));
        (x - column).abs() <= reach.x && differ([column - 0.5, y], [column + 0.5, y])
            || (y - row).abs() <= reach.y && differ([x, row - 0.5], [x, row + 0.5])
    }

    /// The colour of the cell at a place; beyond the tag, of the nearest cell.
    fn color(&self, [x, y]: [f64; 2]) -> Option<&f64> {
        let cell = |x: f64| (x.max(0.0) as usize).min(self.cells - 1);
        self.white.get(cell(y) * self.cells + cell(x))
    }

    /// The tag at a `place` (column, row) under a blur of `covariance`, both in cells. Derivatives leave correlation out.
    pub(super) fn shade(&self, place: Vector2<f64>, covariance: &Matrix2<f64>) -> Shade {
        let sigma = Vector2::new(covariance.m11.sqrt(), covariance.m22.sqrt());
        let correlation = covariance.m12 / (sigma.x * sigma.y).max(MIN_SIGMA * MIN_SIGMA);
        blurred(&self.white, self.cells, place, sigma, correlation.clamp(-1.0, 1.0))
    }
}

/// A square of `side`² cells at a place, under a blur with standard deviations along its rows and columns, and a correlation.
/// The outermost cells go on for ever.
fn blurred(cells: &[f64], side: usize, place: Vector2<f64>, sigma: Vector2<f64>, correlation: f64) -> Shade {
    let sigma = sigma.map(|sigma| sigma.clamp(MIN_SIGMA, MAX_SIGMA));
    let mut columns = [CellShare::default(); MAX_CELLS];
    let (first, mut count) = (first_cell(place.x, sigma.x, side), 0);
    each_cell(place.x, sigma.x, side, |_, share| {
        if let Some(column) = columns.get_mut(count) {
            *column = share;
            count += 1;
        }
    });
    let columns = columns.get(..count).unwrap_or(&[]);
    let mehler = [1.0, correlation, correlation.powi(2) / 2.0, correlation.powi(3) / 6.0];
    let mut shade = Shade::default();
    each_cell(place.y, sigma.y, side, |row, CellShare(rows)| {
        let start = row * side + first;
        let mut sums = [0.0; 4];
        for (white, CellShare(column)) in cells.get(start..start + count).unwrap_or(&[]).iter().zip(columns) {
            sums.iter_mut().zip(column).for_each(|(sum, share)| *sum += white * share);
        }
        let terms = sums.iter().zip(rows).zip(mehler);
        shade.value += terms.map(|((column, row), factor)| column * row * factor).sum::<f64>();
        shade.gradient.x += sums[1] * rows[0];
        shade.gradient.y += sums[0] * rows[1];
        shade.by_log_blur += sums[2] * rows[0] + sums[0] * rows[2];
    });
    shade.gradient.component_div_assign(&sigma);
    shade
}

/// How much one cell of a row or column brings to a place, and the first three derivatives of that by the place, in units of
/// the standard deviation. The second is the derivative by the logarithm of the standard deviation, too.
#[derive(Clone, Copy, Default)]
struct CellShare([f64; 4]);

fn first_cell(place: f64, sigma: f64, side: usize) -> usize {
    ((place - REACH * sigma).max(0.0) as usize).min(side - 1)
}

/// Calls `take` for the cells within reach of a place, in their order.
#[inline(always)]
fn each_cell(place: f64, sigma: f64, side: usize, mut take: impl FnMut(usize, CellShare)) {
    let first = first_cell(place, sigma, side);
    let last = ((place + REACH * sigma).max(0.0) as usize).min(side - 1);
    let per_sigma = 1.0 / sigma;
    // At each boundary between cells: how much lies beyond it.
    let mut before = [1.0, 0.0, 0.0, 0.0];
    for cell in first..=last {
        let after = match cell == last {
            true => [0.0; 4],
            false => {
                let z = (place - (cell + 1) as f64) * per_sigma;
                let (share, density) = normal(z);
                [share, density, -z * density, (z * z - 1.0) * density]
            }
        };
        take(cell, CellShare(std::array::from_fn(|i| before[i] - after[i])));
        before = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::Family;

    fn template() -> Template {
        Template::new(TagId { family: Family::Tag36h11, id: 11 }).unwrap()
    }

    /// The blur as a sum over a fine grid.
    fn by_sum(template: &Template, place: Vector2<f64>, covariance: &Matrix2<f64>) -> f64 {
        let root = covariance.cholesky().unwrap().l();
        let nodes: Vec<f64> = (-240..=240).map(|i| f64::from(i) / 50.0).collect();
        let (mut value, mut weight) = (0.0, 0.0);
        for x in &nodes {
            for y in &nodes {
                let w = (-0.5 * (x * x + y * y)).exp();
                let at = place + root * Vector2::new(*x, *y);
                value += w * template.color([at.x, at.y]).copied().unwrap();
                weight += w;
            }
        }
        value / weight
    }

    #[test]
    fn the_blur_is_that_of_a_sum() {
        let template = template();
        for (correlation, tolerance) in [(0.0, 0.008), (0.5, 0.011), (-0.8, 0.028), (0.9, 0.04)] {
            for (i, sigma) in [[0.15, 0.2], [0.4, 0.3], [0.7, 0.5]].iter().enumerate() {
                let mixed = correlation * sigma[0] * sigma[1];
                let covariance = Matrix2::new(sigma[0] * sigma[0], mixed, mixed, sigma[1] * sigma[1]);
                for j in 0..12 {
                    let place =
                        Vector2::new(0.7 + 0.71 * f64::from(j), 8.9 - 0.63 * f64::from(j) - 0.2 * i as f64);
                    let (found, sum) =
                        (template.shade(place, &covariance).value, by_sum(&template, place, &covariance));
                    // The sum is good to half a step, 1/100, times the density, 0.4, along each axis. The series' next term is
                    // at most 0.3 ρ⁴/24, and those behind it sum to at most three times that.
                    assert!(
                        (found - sum).abs() < tolerance,
                        "{correlation} {sigma:?} {place}: {found} {sum}"
                    );
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let template = template();
        let covariance = |scale: f64| Matrix2::new(0.09, 0.0, 0.0, 0.16) * (scale * scale);
        const STEP: f64 = 1e-3;
        for j in 0..20 {
            let place = Vector2::new(0.6 + 0.44 * f64::from(j), 9.1 - 0.4 * f64::from(j));
            let value = |dx: f64, dy: f64, scale: f64| {
                template.shade(place + Vector2::new(dx, dy), &covariance(scale)).value
            };
            let shade = template.shade(place, &covariance(1.0));
            let slope = |high: f64, low: f64| (high - low) / (2.0 * STEP);
            let by_x = slope(value(STEP, 0.0, 1.0), value(-STEP, 0.0, 1.0));
            let by_y = slope(value(0.0, STEP, 1.0), value(0.0, -STEP, 1.0));
            let by_blur = slope(value(0.0, 0.0, STEP.exp()), value(0.0, 0.0, (-STEP).exp()));
            // The table of φ is straight between points 1/64 apart: its third derivative there is below 10⁻³.
            assert!((shade.gradient - Vector2::new(by_x, by_y)).amax() < 5e-3, "{place}");
            assert!((shade.by_log_blur - by_blur).abs() < 5e-3, "{place}: {} {by_blur}", shade.by_log_blur);
        }
    }
}
