//! How far photons are looked for.

/// Share of the photons kept when the radius shrinks: variance falls and so does bias (Knaus and Zwicker 2011, §4:
/// 2/3 balances the two).
const ALPHA: f64 = 2.0 / 3.0;

/// Radius by pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiusSchedule {
    first_m: f64,
}

impl RadiusSchedule {
    /// From the radius of the first pass, metres.
    pub fn new(first_m: f32) -> Self {
        Self { first_m: f64::from(first_m) }
    }

    /// Of pass `pass`, counted from 0 (Knaus and Zwicker 2011, eq. 20): `r²ᵢ₊₁/r²ᵢ = (i + α)/(i + 1)`, i counted from 1.
    ///
    /// The product is `r₁² Γ(i + α)/(Γ(1 + α) Γ(i + 1))`, evaluated for any pass without the passes before.
    pub fn radius_m(&self, pass: u32) -> f32 {
        /// Beyond, the asymptotic series below is exact to 1e-9.
        const EXACT: u32 = 64;
        let shrink = |from: u32, to: u32| {
            (from..to).fold(1.0, |product, i| product * (f64::from(i) + ALPHA) / (f64::from(i) + 1.0))
        };
        let mut squared = shrink(1, (pass + 1).min(EXACT));
        if pass + 1 > EXACT {
            squared *= gamma_ratio(f64::from(pass) + 1.0) / gamma_ratio(f64::from(EXACT));
        }
        (self.first_m * squared.sqrt()) as f32
    }
}

/// Γ(x + α)/Γ(x + 1) for large x: `x^(α−1) (1 + (α−1)(α)/(2x) + …)` (Tricomi and Erdélyi 1951), written about the middle
/// of the two arguments, where the odd terms vanish.
fn gamma_ratio(x: f64) -> f64 {
    let power = ALPHA - 1.0;
    let middle = x + ALPHA / 2.0;
    let first = -power * (power * power - 1.0) / 24.0;
    middle.powf(power) * (1.0 + first / (middle * middle))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the recurrence as printed.
    #[test]
    fn the_closed_form_is_the_recurrence() {
        let schedule = RadiusSchedule::new(0.02);
        let mut squared: f64 = 0.02 * 0.02;
        for pass in 0..3000_u32 {
            let found = f64::from(schedule.radius_m(pass));
            assert!((found - squared.sqrt()).abs() < 1e-6 * squared.sqrt(), "pass {pass}: {found}");
            let i = f64::from(pass) + 1.0;
            squared *= (i + ALPHA) / (i + 1.0);
        }
    }
}
