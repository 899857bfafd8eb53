//! Limits of sums of squares of normal errors.

/// Standard normal quantile that is exceeded once in 10³.
pub(crate) const ONE_IN_1E3: f64 = 3.090_232;
/// Standard normal quantile that is exceeded once in 10⁴.
pub(crate) const ONE_IN_1E4: f64 = 3.719_016;
/// Standard normal quantile that is exceeded once in 10⁶.
pub(crate) const ONE_IN_1E6: f64 = 4.753_424;

/// Median of χ² with eight degrees of freedom: the corners of one tag.
pub(crate) const MEDIAN_OF_8: f64 = 7.344;

/// The value that χ² with `degrees_of_freedom` exceeds as rarely as a standard normal variable exceeds `normal`
/// (Wilson and Hilferty, 1931; too high by at most 3% for the tails used here, and by 10% for one in 10⁶
/// with two degrees of freedom).
pub(crate) fn limit(degrees_of_freedom: f64, normal: f64) -> f64 {
    let ninth = 2.0 / (9.0 * degrees_of_freedom);
    degrees_of_freedom * (1.0 - ninth + normal * ninth.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_of_tables() {
        for (dof, normal, table, within) in [
            (2.0, ONE_IN_1E3, 13.816, 0.03), // −2 ln p
            (2.0, ONE_IN_1E6, 27.631, 0.1),
            (6.0, ONE_IN_1E4, 27.856, 0.03),
            (8.0, ONE_IN_1E6, 42.701, 0.03),
            (90.0, ONE_IN_1E3, 137.208, 0.03),
            (8.0, 0.0, MEDIAN_OF_8, 0.03),
        ] {
            let error: f64 = limit(dof, normal) / table - 1.0;
            assert!(error.abs() < within, "{dof} {normal}: {error}");
        }
    }
}
