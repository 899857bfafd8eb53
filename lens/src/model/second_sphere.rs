//! The last step that [`DoubleSphere`](super::DoubleSphere) and [`Eucm`](super::Eucm) share: the unified projection
//! (Mei & Rives, ICRA 2007; Geyer & Daniilidis, ECCV 2000) of a unit direction (sin ψ, cos ψ) in the form
//!
//! ```text
//! ρ = sin ψ / (α + (1−α) cos ψ)
//! ```
//!
//! ρ grows with ψ as long as its denominator α + (1−α) cos ψ and the numerator (1−α) + α cos ψ of its slope are
//! positive. The first ends the cone for α < ½ (the image goes to infinity), the second for α > ½ (it turns back).

use super::polynomial::MIN_SLOPE;

/// The smallest valid cos ψ for α in [0, 1]: there one of the two conditions is down to `MIN_SLOPE`. Always in (−1, 1).
pub fn min_cos(alpha: f64) -> f64 {
    let denominator_ends = (MIN_SLOPE - alpha) / (1.0 - alpha);
    let slope_ends = (MIN_SLOPE - 1.0 + alpha) / alpha;
    denominator_ends.max(slope_ends)
}

/// ζ such that (ρ, ζ) points along (sin ψ, cos ψ): Usenko 2018, eq. 50 (EUCM: ρ² times β). `None` if no ψ gives ρ.
pub fn height(alpha: f64, rho_squared: f64) -> Option<f64> {
    let radicand = 1.0 - (2.0 * alpha - 1.0) * rho_squared;
    (radicand >= 0.0).then(|| (1.0 - alpha * alpha * rho_squared) / (alpha * radicand.sqrt() + (1.0 - alpha)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cone_ends_where_the_derivative_or_the_denominator_does() {
        for i in 0..=100 {
            let alpha = f64::from(i) / 100.0;
            let cos = min_cos(alpha);
            assert!(cos > -1.0 && cos < 1.0, "{alpha}: {cos}");
            let (denominator, slope) = (alpha + (1.0 - alpha) * cos, (1.0 - alpha) + alpha * cos);
            assert!((denominator.min(slope) - MIN_SLOPE).abs() < 1e-12, "{alpha}");
        }
    }

    #[test]
    fn height_inverts_the_projection() {
        for (alpha, psi) in [(0.0f64, 1.2f64), (0.3, 1.9), (0.5, 3.0), (0.7, 1.8), (1.0, 1.5)] {
            let rho = psi.sin() / (alpha + (1.0 - alpha) * psi.cos());
            let height = height(alpha, rho * rho).unwrap();
            assert!((rho.atan2(height) - psi).abs() < 1e-12, "{alpha} {psi}");
        }
        assert_eq!(height(1.0, 1.1), None);
    }
}
