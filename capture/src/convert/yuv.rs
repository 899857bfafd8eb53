//! Y′CbCr with subsampled chroma to R′G′B′, a row at a time.

use super::ChromaUpsampling;
use crate::frame::Frame;
use crate::pixel_format::{ColorEncoding, PixelFormat, YuvMatrix, YuvRange};

/// One row's luma and chroma as numbers: split into simple passes that the compiler turns into vector code.
#[derive(Clone, Debug, Default)]
pub(super) struct YuvRows {
    /// Luma less the code of black.
    luma: Vec<f32>,
    /// Chroma samples of the row, at half width, less 128.
    half_cb: Vec<f32>,
    half_cr: Vec<f32>,
    /// Chroma of every pixel, less 128.
    cb: Vec<f32>,
    cr: Vec<f32>,
}

impl YuvRows {
    /// Converts a checked YUYV, UYVY or NV12 frame to packed R′G′B′.
    pub(super) fn convert(&mut self, frame: &Frame, chroma: ChromaUpsampling, out: &mut [u8]) {
        let width = frame.width_px as usize;
        for plane in [&mut self.luma, &mut self.cb, &mut self.cr] {
            plane.resize(width, 0.0);
        }
        for plane in [&mut self.half_cb, &mut self.half_cr] {
            plane.resize(width / 2, 0.0);
        }
        let matrix = RgbFromYuv::of(frame.color);
        for (y, out) in (0..frame.height_px).zip(out.chunks_exact_mut(width * 3)) {
            let Some(row) = frame.row(y) else { return };
            match frame.format {
                PixelFormat::Yuyv => self.split_422(row, matrix.black, |[y0, cb, y1, cr]| [y0, y1, cb, cr]),
                PixelFormat::Uyvy => self.split_422(row, matrix.black, |[cb, y0, cr, y1]| [y0, y1, cb, cr]),
                _ => self.split_nv12(frame, y, row, matrix.black, chroma),
            }
            upsample(&self.half_cb, chroma, &mut self.cb);
            upsample(&self.half_cr, chroma, &mut self.cr);
            matrix.convert_row(&self.luma, &self.cb, &self.cr, out);
        }
    }

    /// `order` turns four bytes into `[Y0, Y1, Cb, Cr]`.
    fn split_422(&mut self, row: &[u8], black: f32, order: impl Fn([u8; 4]) -> [u8; 4]) {
        let luma = self.luma.as_chunks_mut::<2>().0.iter_mut();
        let chroma = self.half_cb.iter_mut().zip(&mut self.half_cr);
        for ((group, luma), (cb, cr)) in row.as_chunks::<4>().0.iter().zip(luma).zip(chroma) {
            let [y0, y1, u, v] = order(*group).map(f32::from);
            *luma = [y0 - black, y1 - black];
            *cb = u - 128.0;
            *cr = v - 128.0;
        }
    }

    fn split_nv12(&mut self, frame: &Frame, y: u32, row: &[u8], black: f32, chroma: ChromaUpsampling) {
        for (luma, code) in self.luma.iter_mut().zip(row) {
            *luma = f32::from(*code) - black;
        }
        let near = y / 2;
        // A chroma row lies between image rows 2i and 2i + 1: a quarter of its spacing from each.
        let other = if y.is_multiple_of(2) {
            near.saturating_sub(1)
        } else {
            (near + 1).min(frame.height_px / 2 - 1)
        };
        let far = match chroma {
            ChromaUpsampling::Linear => other,
            ChromaUpsampling::Nearest => near,
        };
        let (Some(near), Some(far)) = (frame.chroma_row(near), frame.chroma_row(far)) else {
            return;
        };
        let pairs = near.as_chunks::<2>().0.iter().zip(far.as_chunks::<2>().0);
        for ((near, far), (cb, cr)) in pairs.zip(self.half_cb.iter_mut().zip(&mut self.half_cr)) {
            // Quarters of bytes are exact in floating point: nothing is rounded here.
            *cb = (3.0 * f32::from(near[0]) + f32::from(far[0])) * 0.25 - 128.0;
            *cr = (3.0 * f32::from(near[1]) + f32::from(far[1])) * 0.25 - 128.0;
        }
    }
}

/// Chroma of every pixel from samples on the even ones; the last pixel repeats its neighbour's.
fn upsample(half: &[f32], chroma: ChromaUpsampling, full: &mut [f32]) {
    let pixels = full.as_chunks_mut::<2>().0;
    match chroma {
        ChromaUpsampling::Nearest => pixels.iter_mut().zip(half).for_each(|(out, c)| *out = [*c; 2]),
        ChromaUpsampling::Linear => {
            for (out, pair) in pixels.iter_mut().zip(half.windows(2)) {
                *out = [pair[0], (pair[0] + pair[1]) * 0.5];
            }
            if let (Some(out), Some(last)) = (pixels.last_mut(), half.last()) {
                *out = [*last; 2];
            }
        }
    }
}

/// R′G′B′ codes from Y′CbCr codes: ITU-R BT.601-7 §2.5 and BT.709-6 §3 turned around.
struct RgbFromYuv {
    black: f32,
    luma: f32,
    r_cr: f32,
    g_cb: f32,
    g_cr: f32,
    b_cb: f32,
}

impl RgbFromYuv {
    fn of(color: ColorEncoding) -> Self {
        let (kr, kb) = match color.matrix {
            YuvMatrix::Bt601 => (0.299, 0.114),
            YuvMatrix::Bt709 => (0.2126, 0.0722),
        };
        let (black, luma, chroma) = match color.range {
            YuvRange::Full => (0.0, 1.0, 1.0),
            YuvRange::Limited => (16.0, 255.0 / 219.0, 255.0 / 224.0),
        };
        let kg: f64 = 1.0 - kr - kb;
        Self {
            black,
            luma: luma as f32,
            r_cr: (2.0 * (1.0 - kr) * chroma) as f32,
            g_cb: (2.0 * (1.0 - kb) * kb / kg * chroma) as f32,
            g_cr: (2.0 * (1.0 - kr) * kr / kg * chroma) as f32,
            b_cb: (2.0 * (1.0 - kb) * chroma) as f32,
        }
    }

    fn convert_row(&self, luma: &[f32], cb: &[f32], cr: &[f32], out: &mut [u8]) {
        let chroma = cb.iter().zip(cr);
        for ((out, luma), (cb, cr)) in out.as_chunks_mut::<3>().0.iter_mut().zip(luma).zip(chroma) {
            let y = self.luma * luma;
            *out = [
                code(y + self.r_cr * cr),
                code(y - self.g_cb * cb - self.g_cr * cr),
                code(y + self.b_cb * cb),
            ];
        }
    }
}

/// Clips to 0…255 and rounds to nearest, halves to even.
fn code(value: f32) -> u8 {
    // At 2²³ the spacing of floats is one: the addition rounds, and the code is the mantissa's low byte. Unlike a
    // call of `round` this becomes vector code on every processor.
    const ONE_SPACING: f32 = 8_388_608.0;
    (value.clamp(0.0, 255.0) + ONE_SPACING).to_bits() as u8
}
