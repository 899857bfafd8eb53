//! What the library must not be given; it does not check. Names in code type are functions of its version 3.4.5.

use super::settings::{DetectorError, DetectorSettings};
use crate::luma::Luma;

/// Images whose shorter side, made smaller, is below this hold no tag that could be read, and no tile of the threshold
/// (`threshold`).
const MIN_SIDE_PX: u32 = 8;
/// The area of an outline in half pixels must fit 31 bits (`fit_quad`).
const MAX_SIDE_PX: u32 = 16_384;
/// Pixels that are searched; each takes the library about 12 bytes.
const MAX_SEARCHED_PX: u64 = 8192 * 8192;

/// How an image is searched, so that the library survives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Search {
    pub(super) threads: u32,
    pub(super) blur_px: f32,
}

impl Search {
    /// `None` if the image is too small for tags.
    pub(super) fn new(settings: &DetectorSettings, image: &Luma) -> Result<Option<Self>, DetectorError> {
        let (width_px, height_px) = (image.width_px(), image.height_px());
        let [width, height] = [width_px, height_px].map(|side| searched_side_px(side, settings.decimate));
        if width_px.max(height_px) > MAX_SIDE_PX || u64::from(width) * u64::from(height) > MAX_SEARCHED_PX {
            return Err(DetectorError::Image { width_px, height_px, decimate: settings.decimate });
        }
        let large_enough = width.min(height) >= MIN_SIDE_PX;
        Ok(large_enough.then(|| Self {
            threads: threads(settings.threads, width, height),
            blur_px: blur_px(settings.blur_px, width.min(height)),
        }))
    }
}

/// A side of the image in which outlines are looked for (`image_u8_decimate`).
fn searched_side_px(side_px: u32, decimate: f32) -> u32 {
    match decimate == 1.5 {
        true => side_px / 3 * 2,
        false => side_px.div_ceil(decimate as u32),
    }
}

/// Each thread takes ten shares of the rows and has room for 0.4 pairs of black and white areas per pixel of a share, at least
/// for 2048 (`do_gradient_clusters`). Upright stripes one pixel wide, broken once, make two pairs per column.
fn threads(wanted: u32, width: u32, height: u32) -> u32 {
    const ROWS_OF_A_SHARE: u32 = 5;
    match 2 * width <= 2048 {
        true => wanted,
        false => wanted.min((height - 1) / (10 * (ROWS_OF_A_SHARE - 1))).max(1),
    }
}

/// A kernel longer than a row writes before the row (`convolve`): such images are not blurred.
fn blur_px(wanted: f32, shorter_side: u32) -> f32 {
    let kernel = (4.0 * wanted.abs()) as u32 | 1;
    if kernel <= shorter_side { wanted } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_the_librarys() {
        let sides = [(8, 1.0), (8, 1.5), (9, 1.5), (720, 2.0), (721, 2.0), (1, 16.0), (720, 7.0)];
        assert_eq!(
            sides.map(|(side, decimate)| searched_side_px(side, decimate)),
            [8, 4, 6, 360, 361, 1, 103]
        );
    }

    #[test]
    fn shares_of_wide_images_have_five_rows() {
        for (width, height, wanted) in [(1280, 720, 64), (16_384, 40, 8), (1025, 8, 64), (4000, 81, 2)] {
            let threads = threads(wanted, width, height);
            let rows = 1 + (height - 1) / (10 * threads);
            assert!(threads == 1 || rows >= 5, "{width} x {height}: {threads}");
        }
        assert_eq!(threads(64, 640, 360), 64);
        assert_eq!(threads(8, 1920, 1080), 8);
    }

    #[test]
    fn kernels_fit_the_image() {
        // 4 · 8 + 1 pixels.
        assert_eq!((blur_px(-8.0, 33), blur_px(8.0, 32), blur_px(0.0, 8)), (-8.0, 0.0, 0.0));
    }
}
