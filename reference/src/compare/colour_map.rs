//! Colours for signed and unsigned figures.

use coshade_image_file::srgb;

/// A diverging map in CIELAB: blue for −1, light grey for 0, red for +1, equal steps of lightness and chroma.
///
/// The ends are those of K. Moreland, "Diverging Color Maps for Scientific Visualization", 2009: of equal lightness, so
/// that neither sign looks larger. Input is clamped to [−1, 1].
pub fn diverging(value: f64) -> [u8; 3] {
    const GREY_LIGHTNESS: f64 = 88.0;
    // Moreland's Msh ends: magnitude 80, saturation angle 1.08.
    let (end_lightness, end_chroma) = (80.0 * 1.08f64.cos(), 80.0 * 1.08f64.sin());
    let value = value.clamp(-1.0, 1.0);
    let hue = if value < 0.0 { -1.1f64 } else { 0.5 };
    let chroma = end_chroma * value.abs();
    let lightness = GREY_LIGHTNESS + (end_lightness - GREY_LIGHTNESS) * value.abs();
    srgb_from_lab([lightness, chroma * hue.cos(), chroma * hue.sin()])
}

/// CIELAB (D65) to 8-bit sRGB, clipped to the gamut.
fn srgb_from_lab([lightness, a, b]: [f64; 3]) -> [u8; 3] {
    let cube = |t: f64| {
        let threshold = 6.0 / 29.0;
        if t > threshold { t * t * t } else { 3.0 * threshold * threshold * (t - 4.0 / 29.0) }
    };
    let y = (lightness + 16.0) / 116.0;
    let [x, y, z] = [0.95047 * cube(y + a / 500.0), cube(y), 1.08883 * cube(y - b / 200.0)];
    let linear = [
        3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
        -0.969266 * x + 1.8760108 * y + 0.041556 * z,
        0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
    ];
    linear.map(|value| srgb::encode_to_code(value as f32, 255) as u8)
}

/// The magma map of matplotlib, which FLIP pictures use, as polynomials of degree 6 (M. Zucker): black for 0, light
/// yellow for 1. Input is clamped to [0, 1].
pub fn magma(value: f64) -> [u8; 3] {
    const COEFFICIENTS: [[f64; 7]; 3] = [
        [
            -0.002136485053939582,
            0.2516605407371642,
            8.353717279216625,
            -27.66873308576866,
            52.17613981234068,
            -50.76852536473588,
            18.65570506591883,
        ],
        [
            -0.000749655052795221,
            0.6775232436837668,
            -3.577719514958484,
            14.26473078096533,
            -27.94360607168351,
            29.04658282127291,
            -11.48977351997711,
        ],
        [
            -0.005386127855323933,
            2.494026599312351,
            0.3144679030132573,
            -13.64921318813922,
            12.94416944238394,
            4.23415299384598,
            -5.601961508734096,
        ],
    ];
    let t = value.clamp(0.0, 1.0);
    COEFFICIENTS.map(|coefficients| {
        let code = coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * t + coefficient);
        (code.clamp(0.0, 1.0) * 255.0).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magma_is_that_of_the_authors_to_the_eye() {
        let table = nv_flip::magma_lut().to_vec();
        for (index, theirs) in table.chunks_exact(3).enumerate() {
            let ours = magma(index as f64 / 255.0);
            for (ours, theirs) in ours.iter().zip(theirs) {
                assert!(ours.abs_diff(*theirs) <= 5, "{index}: {ours:?} {theirs:?}");
            }
        }
    }

    #[test]
    fn zero_is_neutral_and_the_ends_are_morelands() {
        let [r, g, b] = diverging(0.0);
        assert!(r.abs_diff(g) <= 1 && g.abs_diff(b) <= 1 && (215..=230).contains(&g), "{r} {g} {b}");
        let near =
            |colour: [u8; 3], expected: [u8; 3]| colour.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 3);
        assert!(near(diverging(-1.0), [59, 76, 192]), "{:?}", diverging(-1.0));
        assert!(near(diverging(1.0), [180, 4, 38]), "{:?}", diverging(1.0));
    }
}
