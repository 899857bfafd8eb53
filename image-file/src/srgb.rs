//! The sRGB transfer curve of IEC 61966-2-1, exactly: a linear toe, then a power of 2.4.

/// Code value (0 to 1) to linear radiance. Values beyond [0, 1] follow the same curve; negative ones its toe.
pub fn decode(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}

/// Linear radiance to code value (0 to 1 for input of 0 to 1). The inverse of [`decode`].
pub fn encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// [`encode`] of a value clipped to [0, 1], as an integer code of `0..=max_code`, rounded to nearest.
pub fn encode_to_code(linear: f32, max_code: u16) -> u16 {
    let code = encode(f64::from(linear).clamp(0.0, 1.0));
    (code * f64::from(max_code)).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_points_of_the_standard() {
        // 0.21404114 is the linear value of code 0.5; code 0.04045 is where toe and power meet.
        assert!((decode(0.5) - 0.214_041_14).abs() < 1e-8);
        assert!((encode(0.214_041_14) - 0.5).abs() < 1e-8);
        assert_eq!(decode(1.0), 1.0);
        assert_eq!(decode(0.0), 0.0);
        assert!((decode(10.0 / 255.0) - 10.0 / 255.0 / 12.92).abs() < 1e-15);
    }

    #[test]
    fn every_16_bit_code_survives_a_round_trip_through_f32() {
        for code in 0..=u16::MAX {
            let linear = decode(f64::from(code) / 65535.0) as f32;
            assert_eq!(encode_to_code(linear, u16::MAX), code);
        }
    }
}
