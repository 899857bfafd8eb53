//! The sRGB curve for 8-bit codes.

use std::sync::LazyLock;

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|code| coshade_image_file::srgb::decode(code as f64 / 255.0) as f32)
});

/// Code value to linear.
pub fn decode(code: u8) -> f32 {
    LINEAR[usize::from(code)]
}
