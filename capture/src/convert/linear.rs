//! Linear light to sRGB codes, for looking.

use std::sync::LazyLock;

use coshade_image_file::srgb;

/// Cells of 0…1, each narrower than the light of any code: no more than one code begins in it.
const CELLS: usize = 4096;

struct Codes {
    /// The light at which code n + 1 begins; none does after the last.
    starts: [f64; 256],
    /// The code of the least light of each cell, and that of 1.
    of_cell: [u8; CELLS + 1],
}

static CODES: LazyLock<Codes> = LazyLock::new(|| {
    let start = |code| if code < 255 { srgb::decode((code as f64 + 0.5) / 255.0) } else { f64::INFINITY };
    let starts = std::array::from_fn(start);
    let code = |light: f64| starts.partition_point(|start| *start <= light) as u8;
    Codes { starts, of_cell: std::array::from_fn(|cell| code(cell as f64 / CELLS as f64)) }
});

/// The 8 bit code of linear light by IEC 61966-2-1, clipped to 0…255 and rounded to nearest.
///
/// By a table instead of a power, which takes many times as long.
pub(super) fn code(light: f32) -> u8 {
    let light = f64::from(light).clamp(0.0, 1.0);
    let code = CODES.of_cell[(light * CELLS as f64) as usize];
    code + u8::from(light >= CODES.starts[usize::from(code)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_has_two_codes_that_begin() {
        let narrowest = CODES.starts[..255].windows(2).map(|pair| pair[1] - pair[0]).fold(f64::MAX, f64::min);
        assert!(narrowest > 1.0 / CELLS as f64, "{narrowest}");
    }

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
