//! The normal distribution, from a table: it is evaluated some ten thousand times for each tag.

use std::sync::OnceLock;

/// Beyond this many standard deviations the distribution is taken to be over: Φ(−4.5) = 3·10⁻⁶.
const REACH: f64 = 4.5;
const STEPS_PER_SIGMA: f64 = 64.0;
const ENTRIES: usize = (2.0 * REACH * STEPS_PER_SIGMA) as usize + 2;

/// Φ and φ at points 1/64 apart.
fn table() -> &'static [[f64; 2]; ENTRIES] {
    static TABLE: OnceLock<[[f64; 2]; ENTRIES]> = OnceLock::new();
    TABLE.get_or_init(|| {
        let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let mut entries = [[0.0; 2]; ENTRIES];
        let mut distribution = 0.0;
        let step = 1.0 / STEPS_PER_SIGMA;
        for (index, entry) in entries.iter_mut().enumerate() {
            let x = index as f64 * step - REACH;
            *entry = [distribution, density(x)];
            // Simpson's rule over the step.
            distribution += step / 6.0 * (density(x) + 4.0 * density(x + 0.5 * step) + density(x + step));
        }
        entries
    })
}

/// Φ(x) and φ(x) of the standard normal distribution, to 10⁻⁵: Φ falls to 0 and rises to 1 outside of ±4.5.
#[inline]
pub(super) fn normal(x: f64) -> (f64, f64) {
    if x <= -REACH {
        return (0.0, 0.0);
    }
    let position = (x + REACH) * STEPS_PER_SIGMA;
    let index = position as usize;
    let table = table();
    let (Some([low, slope_low]), Some([high, slope_high])) = (table.get(index), table.get(index + 1)) else {
        return (1.0, 0.0);
    };
    let t = position - index as f64;
    // Cubic Hermite interpolation of Φ, whose derivative φ is known; linear of φ itself.
    let step = 1.0 / STEPS_PER_SIGMA;
    let (u, tt) = (1.0 - t, t * t);
    let distribution =
        low + (high - low) * tt * (3.0 - 2.0 * t) + step * t * u * (slope_low * u - slope_high * t);
    (distribution, slope_low + (slope_high - slope_low) * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_distribution() {
        // Abramowitz and Stegun, table 26.1.
        for (x, expected) in [(0.0, 0.5), (1.0, 0.841_344_746), (-2.0, 0.022_750_132), (0.5, 0.691_462_461)] {
            assert!((normal(x).0 - expected).abs() < 1e-5, "{x}");
        }
        assert_eq!(normal(-9.0), (0.0, 0.0));
        assert_eq!(normal(9.0), (1.0, 0.0));
        for step in -400..400 {
            let x = f64::from(step) * 0.0123;
            let slope = (normal(x + 1e-4).0 - normal(x - 1e-4).0) / 2e-4;
            assert!((slope - normal(x).1).abs() < 2e-4, "{x}");
        }
    }
}
