//! Linear light to sRGB codes, for looking.

use std::sync::LazyLock;

use coshade_image_file::srgb;

/// Where sRGB codes begin: a value has the code of how many of these it reaches.
static CODE_STARTS: LazyLock<[f64; 255]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb::decode((code as f64 + 0.5) / 255.0)));

/// The 8 bit code of linear light by IEC 61966-2-1, clipped to 0…255 and rounded to nearest.
///
/// By search instead of a power, which takes several times as long.
pub(super) fn code(light: f32) -> u8 {
    let light = f64::from(light);
    // At most 255.
    CODE_STARTS.partition_point(|start| *start <= light) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_of_the_formula() {
        for n in 0..=200_000_u32 {
            let light = n as f32 / 180_000.0 - 0.05;
            assert_eq!(u16::from(code(light)), srgb::encode_to_code(light, 255), "{light}");
        }
        for (light, expected) in [(f32::MAX, 255), (f32::MIN, 0), (-0.0, 0), (1.0, 255), (0.214_041_14, 128)]
        {
            assert_eq!(code(light), expected, "{light}");
        }
    }
}
