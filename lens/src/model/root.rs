//! The inverse of an increasing function.

/// The root of `f(x) = target` on [0, `hi`] for an `f` that increases there, `f(0) ≤ target ≤ f(hi)`.
///
/// `f` gives value and slope. Newton's method, kept inside a bracket that shrinks at every step; when it has not
/// converged after a few steps, every second step halves the bracket. So it always ends, after some 200 evaluations
/// at the very worst and after three to six for a lens. `None` if `f` is not a number somewhere. A target outside
/// [f(0), f(hi)] gives a number near that end of the bracket.
pub fn increasing_root(f: impl Fn(f64) -> (f64, f64), target: f64, hi: f64, guess: f64) -> Option<f64> {
    const FREE_NEWTON_STEPS: usize = 8;
    const MAX_STEPS: usize = 300;
    let (mut lo, mut hi) = (0.0, hi);
    let mut x = guess.clamp(lo, hi);
    for step in 0..MAX_STEPS {
        let (value, slope) = f(x);
        let error = value - target;
        if error.is_nan() {
            return None;
        }
        if error > 0.0 {
            hi = x;
        } else {
            lo = x;
        }
        if error == 0.0 {
            return Some(x);
        }
        let newton = x - error / slope;
        if (newton - x).abs() <= 2.0 * f64::EPSILON * x {
            return Some(newton.clamp(lo, hi));
        }
        let middle = lo + 0.5 * (hi - lo);
        if middle <= lo || middle >= hi {
            return Some(x);
        }
        let take_newton = newton > lo && newton < hi && (step < FREE_NEWTON_STEPS || step % 2 == 0);
        x = if take_newton { newton } else { middle };
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverts_a_steep_and_a_flat_function() {
        let cube = |x: f64| (x * x * x, 3.0 * x * x);
        assert!((increasing_root(cube, 8.0, 1e8, 1e8).unwrap() - 2.0).abs() < 1e-15);
        assert!((increasing_root(cube, 1e-30, 1.0, 0.0).unwrap() - 1e-10).abs() < 1e-24);
        let atan = |x: f64| (x.atan(), 1.0 / (1.0 + x * x));
        assert!((increasing_root(atan, 1.5, 1e6, 1e5).unwrap() - 1.5f64.tan()).abs() < 1e-13 * 14.0);
    }

    #[test]
    fn ends_without_a_root() {
        assert_eq!(increasing_root(|_| (f64::NAN, 1.0), 1.0, 1.0, 0.5), None);
        assert_eq!(increasing_root(|x| (x, 0.0), 0.5, 1.0, 0.0), Some(0.5));
        assert!(increasing_root(|x| (x, 1.0), 5.0, 1.0, 0.5).unwrap() > 1.0 - 1e-15);
    }
}
