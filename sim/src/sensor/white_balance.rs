//! White balance as a colour temperature.

/// Wavelengths at which the channels of a typical sensor are most sensitive, metres.
const CHANNELS_M: [f64; 3] = [610e-9, 540e-9, 465e-9];
/// h c / k, metre kelvin.
const SECOND_RADIATION_M_K: f64 = 1.438_776_877e-2;

/// What each channel is multiplied by when the balance is set to `kelvin` instead of `calibrated_kelvin`; green keeps
/// its value. A balance undoes the colour of a black body of its temperature (Planck's law), so a higher one turns the
/// image yellower.
pub fn channel_gains(kelvin: f64, calibrated_kelvin: f64) -> [f64; 3] {
    let (set, calibrated) = (white(kelvin), white(calibrated_kelvin));
    [0, 1, 2].map(|channel: usize| calibrated[channel] / set[channel])
}

/// Light of a black body in the three channels, green 1.
fn white(kelvin: f64) -> [f64; 3] {
    let radiance = CHANNELS_M.map(|m| m.powi(-5) / (SECOND_RADIATION_M_K / (m * kelvin)).exp_m1());
    radiance.map(|channel| channel / radiance[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_higher_temperature_is_yellower_and_the_calibrated_one_changes_nothing() {
        assert_eq!(channel_gains(4500.0, 4500.0), [1.0; 3]);
        let [red, green, blue] = channel_gains(6500.0, 4500.0);
        assert!(red > 1.0 && green == 1.0 && blue < 1.0);
        // Wien's law: ln of the ratio of two channels changes with c₂ (1/λ₁ − 1/λ₂)(1/T₁ − 1/T₂); exp(−c₂/λT) < 0.006.
        let expected = SECOND_RADIATION_M_K * (1.0 / 610e-9 - 1.0 / 465e-9) * (1.0 / 6500.0 - 1.0 / 4500.0);
        assert!(((red / blue).ln() - expected).abs() < 0.02, "{} {expected}", (red / blue).ln());
    }
}
