//! Polynomials in one variable, and how far from zero one is provably positive.

/// Coefficients in rising order: `p[0] + p[1] x + p[2] x² + …`.
pub type Polynomial = Vec<f64>;

/// By how much a slope must exceed zero for its inverse to count as well conditioned, relative to the sum of the
/// magnitudes of its terms.
///
/// Where slope/magnitude = c, rounding errors of ε = 2⁻⁵² per term move the inverse by about ε/c, relatively. With
/// c = 10⁻⁴ and some ten roundings that is 2·10⁻¹¹, fifty times below the 10⁻⁹ promised for round trips. The
/// price is tiny: the slope falls linearly towards a turning point, so the cone loses some 10⁻⁴ of its angle, and
/// the image, whose slope is nearly zero there, some 10⁻⁸ of its radius.
pub const MIN_SLOPE: f64 = 1e-4;

/// The product.
pub fn product(a: &[f64], b: &[f64]) -> Polynomial {
    let mut out = vec![0.0; (a.len() + b.len()).saturating_sub(1)];
    for (i, x) in a.iter().enumerate() {
        for (o, y) in out.iter_mut().skip(i).zip(b) {
            *o += x * y;
        }
    }
    out
}

/// `a + factor · b`.
pub fn sum(a: &[f64], factor: f64, b: &[f64]) -> Polynomial {
    let at = |p: &[f64], i: usize| p.get(i).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).map(|i| at(a, i) + factor * at(b, i)).collect()
}

/// `2 s p'(s)`, which is `r d/dr p(r²)` written in s = r².
pub fn twice_s_derivative(p: &[f64]) -> Polynomial {
    p.iter().enumerate().map(|(i, c)| 2.0 * i as f64 * c).collect()
}

/// `p(r²)` as a polynomial in r.
pub fn of_square(p: &[f64]) -> Polynomial {
    let mut out = vec![0.0; (2 * p.len()).saturating_sub(1)];
    for (o, c) in out.iter_mut().step_by(2).zip(p) {
        *o = *c;
    }
    out
}

/// All coefficients by magnitude: bounds the sum of the magnitudes of the terms for x ≥ 0.
pub fn magnitude(p: &[f64]) -> Polynomial {
    p.iter().map(|c| c.abs()).collect()
}

/// The largest x ≤ `limit` such that the polynomial is positive on all of [0, x).
///
/// Walks from 0 in steps that are proved positive: with the polynomial expanded around the current x, the constant
/// term outweighs all negative terms at the end of the step, hence everywhere in it. So no zero is stepped over,
/// however narrow the dip; where proof gets too slow, the answer is too small, never too large.
pub fn positive_up_to(polynomial: &[f64], limit: f64) -> f64 {
    const MAX_STEPS: usize = 5_000;
    let mut x = 0.0;
    let mut step = limit;
    for _ in 0..MAX_STEPS {
        let local = expanded_around(polynomial, x);
        step = (2.0 * step).min(limit - x);
        while !is_positive_within(&local, step) {
            step *= 0.5;
            if step <= x * f64::EPSILON {
                return x;
            }
        }
        x += step;
        if x >= limit {
            return limit;
        }
    }
    x
}

/// Coefficients of `p(x + t)` in t (repeated synthetic division).
fn expanded_around(p: &[f64], x: f64) -> Polynomial {
    let mut out = p.to_vec();
    for start in 0..out.len() {
        let mut carry = 0.0;
        for c in out.iter_mut().skip(start).rev() {
            carry = carry * x + *c;
            *c = carry;
        }
    }
    out
}

/// Whether the polynomial is surely positive on [0, `width`]: false for NaN.
fn is_positive_within(p: &[f64], width: f64) -> bool {
    let worst = p.iter().enumerate().rev().fold(0.0, |worst, (i, &c)| {
        let c = if i == 0 { c } else { c.min(0.0) };
        worst * width + c
    });
    worst > 0.0 && p.iter().all(|c| c.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(p: &[f64], x: f64) -> f64 {
        p.iter().rev().fold(0.0, |value, c| value * x + c)
    }

    #[test]
    fn operations_agree_with_evaluation() {
        let (a, b) = ([1.0, -2.0, 0.5], [3.0, 0.25]);
        let a_slope = -2.0 + 1.5; // a'(1.5) = −2 + 2·0.5·1.5
        assert_eq!(at(&product(&a, &b), 1.5), at(&a, 1.5) * at(&b, 1.5));
        assert_eq!(at(&sum(&b, 2.0, &a), 1.5), at(&b, 1.5) + 2.0 * at(&a, 1.5));
        assert_eq!(at(&of_square(&a), 1.5), at(&a, 2.25));
        assert_eq!(at(&twice_s_derivative(&a), 1.5), 2.0 * 1.5 * a_slope);
        assert_eq!(at(&expanded_around(&a, 0.5), 1.5), at(&a, 2.0));
    }

    #[test]
    fn the_first_zero_is_found() {
        // (1 − x)(3 − x)
        assert!((positive_up_to(&[3.0, -4.0, 1.0], 10.0) - 1.0).abs() < 1e-12);
        assert_eq!(positive_up_to(&[1.0, 0.0, 1.0], 10.0), 10.0);
        assert_eq!(positive_up_to(&[0.0, 1.0], 10.0), 0.0);
        assert_eq!(positive_up_to(&[f64::NAN, 1.0], 10.0), 0.0);
        assert_eq!(positive_up_to(&[1.0, f64::INFINITY], 10.0), 0.0);
    }

    #[test]
    fn a_narrow_dip_is_not_stepped_over() {
        // (x − 1)² − 10⁻¹² is negative only within 10⁻⁶ of 1; with + it never is.
        let below = positive_up_to(&[1.0 - 1e-12, -2.0, 1.0], 1e8);
        assert!((below - (1.0 - 1e-6)).abs() < 1e-9, "{below}");
        assert_eq!(positive_up_to(&[1.0 + 1e-9, -2.0, 1.0], 1e8), 1e8);
    }
}
