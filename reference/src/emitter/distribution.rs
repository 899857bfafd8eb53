//! Discrete distributions, inverted.

/// Numbers 0 … n−1 with given weights.
///
/// Inversion keeps the order of the random numbers, and so their stratification (an alias table would not). Random
/// numbers have 24 bits: probabilities below about 1e-6 are met to a few per cent only.
#[derive(Clone, Debug, PartialEq)]
pub struct Discrete {
    /// `cdf[i]` = probability of a number ≤ i; the last is 1.
    cdf: Vec<f64>,
    total: f64,
}

/// A number drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Which.
    pub index: usize,
    /// Its probability.
    pub probability: f64,
    /// What is left of the random number: uniform in [0, 1) again.
    pub rest: f32,
}

impl Discrete {
    /// From weights that are finite and not negative; `None` if all are zero, or any is not like that.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut total = 0.0;
        let mut cdf = Vec::new();
        for weight in weights {
            if !(weight.is_finite() && weight >= 0.0) {
                return None;
            }
            total += weight;
            cdf.push(total);
        }
        if !(total.is_finite() && total > 0.0) {
            return None;
        }
        for sum in &mut cdf {
            *sum /= total;
        }
        Some(Self { cdf, total })
    }

    /// Sum of all weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Of a number; 0 beyond the last.
    pub fn probability(&self, index: usize) -> f64 {
        self.cdf.get(index).map_or(0.0, |upper| upper - self.below(index))
    }

    /// Draws a number with `u` in [0, 1). Never one of probability 0.
    pub fn sample(&self, u: f32) -> Choice {
        let u = f64::from(u);
        let index = self.cdf.partition_point(|&upper| upper <= u).min(self.cdf.len() - 1);
        let probability = self.probability(index);
        let rest = ((u - self.below(index)) / probability) as f32;
        Choice { index, probability, rest: rest.clamp(0.0, 1.0 - f32::EPSILON / 2.0) }
    }

    fn below(&self, index: usize) -> f64 {
        index.checked_sub(1).and_then(|before| self.cdf.get(before)).copied().unwrap_or(0.0)
    }
}

/// Cells of a grid with given weights: a row by the rows' sums, then a column within it.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    rows: Discrete,
    /// `None` for rows of weight 0.
    columns: Vec<Option<Discrete>>,
}

impl Grid {
    /// From `weights[y · width + x]`; `None` as for [`Discrete::new`].
    pub fn new(width: usize, weights: &[f64]) -> Option<Self> {
        let columns: Vec<Option<Discrete>> =
            weights.chunks(width.max(1)).map(|row| Discrete::new(row.iter().copied())).collect();
        if weights.iter().any(|&weight| !(weight.is_finite() && weight >= 0.0)) {
            return None;
        }
        let sums = columns.iter().map(|row| row.as_ref().map_or(0.0, Discrete::total));
        let rows = Discrete::new(sums)?;
        Some(Self { rows, columns })
    }

    /// Sum of all weights.
    pub fn total(&self) -> f64 {
        self.rows.total()
    }

    /// Of cell (x, y).
    pub fn probability(&self, x: usize, y: usize) -> f64 {
        let column = self.columns.get(y).and_then(Option::as_ref);
        column.map_or(0.0, |column| self.rows.probability(y) * column.probability(x))
    }

    /// Draws a cell; the rests of both numbers are left, `[x, y]`.
    pub fn sample(&self, u2: glam::Vec2) -> Option<([usize; 2], [f32; 2])> {
        let row = self.rows.sample(u2.y);
        let column = self.columns.get(row.index)?.as_ref()?.sample(u2.x);
        Some(([column.index, row.index], [column.rest, row.rest]))
    }
}
