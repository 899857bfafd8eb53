//! What a tag looks like through a blur: its cells convolved with a Gaussian of any covariance.
//!
//! A Gaussian blur of the image is, on the tag, a Gaussian whose covariance S follows the tilt. With ρ the magnitude of its
//! correlation, S = (1 − ρ)·diag(S) + ρ·v vᵀ, v = (√S₁₁, ±√S₂₂): a blur along the rows and columns of cells, exact by
//! differences of normal distributions, after one along a line, by Gauss–Hermite quadrature.

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

/// Nodes and weights of ∫ f(t) N(t; 0, 1) dt.
const ONE: [(f64, f64); 1] = [(0.0, 1.0)];
const THREE: [(f64, f64); 3] = [(-1.732_050_808, 1.0 / 6.0), (0.0, 2.0 / 3.0), (1.732_050_808, 1.0 / 6.0)];
const SEVEN: [(f64, f64); 7] = [
    (-3.750_439_718, 0.000_548_268_9),
    (-2.366_759_411, 0.030_757_124),
    (-1.154_405_395, 0.240_123_179),
    (0.0, 0.457_142_857),
    (1.154_405_395, 0.240_123_179),
    (2.366_759_411, 0.030_757_124),
    (3.750_439_718, 0.000_548_268_9),
];

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
        1.0 - blurred(&self.known, self.cells + 2, place + Vector2::repeat(1.0), sigma).value
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

    /// The tag at a `place` (column, row) under a blur of `covariance`, both in cells. Fast: without the correlation of the
    /// blur, which matters where edges meet.
    pub(super) fn shade(&self, place: Vector2<f64>, covariance: &Matrix2<f64>, fast: bool) -> Shade {
        let sigma =
            Vector2::new(covariance.m11.sqrt(), covariance.m22.sqrt()).sup(&Vector2::repeat(MIN_SIGMA));
        let correlation = (covariance.m12 / (sigma.x * sigma.y)).clamp(-0.98, 0.98);
        let rho = correlation.abs();
        let nodes: &[(f64, f64)] = match rho {
            _ if fast || rho < 0.15 => &ONE,
            _ if rho < 0.5 => &THREE,
            _ => &SEVEN,
        };
        let along = Vector2::new(sigma.x, sigma.y * correlation.signum()) * rho.sqrt();
        // Edges run along rows and columns: away from their ends, correlation is nothing to them.
        let across = if nodes.len() == 1 { sigma } else { sigma * (1.0 - rho).sqrt() };
        let mut shade = Shade::default();
        for (node, weight) in nodes {
            let offset = along * *node;
            let at = blurred(&self.white, self.cells, place + offset, across);
            shade.value += weight * at.value;
            shade.gradient += at.gradient * *weight;
            shade.by_log_blur += weight * (at.by_log_blur + at.gradient.dot(&offset));
        }
        shade
    }
}

/// A square of `side`² cells at a place, under a blur along its rows and columns. The outermost cells go on for ever.
fn blurred(cells: &[f64], side: usize, place: Vector2<f64>, sigma: Vector2<f64>) -> Shade {
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
    let mut shade = Shade::default();
    each_cell(place.y, sigma.y, side, |row, share| {
        let start = row * side + first;
        let (mut value, mut by_x, mut by_sigma) = (0.0, 0.0, 0.0);
        for (white, column) in cells.get(start..start + count).unwrap_or(&[]).iter().zip(columns) {
            value += white * column.share;
            by_x += white * column.by_place;
            by_sigma += white * column.by_log_sigma;
        }
        shade.value += value * share.share;
        shade.gradient.x += by_x * share.share;
        shade.gradient.y += value * share.by_place;
        shade.by_log_blur += by_sigma * share.share + value * share.by_log_sigma;
    });
    shade
}

/// How much one cell of a row or column brings to a place, and its derivatives.
#[derive(Clone, Copy, Default)]
struct CellShare {
    share: f64,
    by_place: f64,
    by_log_sigma: f64,
}

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
    let mut before = CellShare { share: 1.0, by_place: 0.0, by_log_sigma: 0.0 };
    for cell in first..=last {
        let after = match cell == last {
            true => CellShare::default(),
            false => {
                let z = (place - (cell + 1) as f64) * per_sigma;
                let (share, density) = normal(z);
                CellShare { share, by_place: density * per_sigma, by_log_sigma: -z * density }
            }
        };
        let share = CellShare {
            share: before.share - after.share,
            by_place: before.by_place - after.by_place,
            by_log_sigma: before.by_log_sigma - after.by_log_sigma,
        };
        take(cell, share);
        before = after;
    }
}
