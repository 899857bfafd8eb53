//! Pixel conversion against the formulas of the ITU and against other decoders.
//!
//! `tests/data/formats.json` is made by `tests/peers/formats.py` of the workspace.
#![allow(clippy::unwrap_used, reason = "helpers of tests panic as tests do")]

use std::sync::LazyLock;

use coshade_capture::convert::ConvertError;
use coshade_capture::convert::jpeg::{JpegError, JpegHeader};
use coshade_capture::{
    ChromaUpsampling, ColorEncoding, Converter, Frame, FramePool, PixelFormat, YuvMatrix, YuvRange,
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Peers {
    width: u32,
    height: u32,
    yuv: Vec<YuvCase>,
    flat: Vec<FlatCase>,
    linear: LinearCase,
    jpeg: Vec<JpegCase>,
}

#[derive(Deserialize)]
struct YuvCase {
    format: PixelFormat,
    data: String,
    expected: Vec<Expected>,
    opencv: String,
}

#[derive(Deserialize)]
struct Expected {
    matrix: YuvMatrix,
    range: YuvRange,
    chroma: String,
    rgb: String,
}

#[derive(Deserialize)]
struct FlatCase {
    matrix: YuvMatrix,
    range: YuvRange,
    yuv: [u8; 3],
    rgb: [u8; 3],
}

#[derive(Deserialize)]
struct LinearCase {
    data: String,
    rgb: String,
}

#[derive(Deserialize)]
struct JpegCase {
    kind: String,
    width: u32,
    height: u32,
    jpeg: String,
    rgb: String,
    luma: String,
}

static PEERS: LazyLock<Peers> =
    LazyLock::new(|| serde_json::from_str(include_str!("data/formats.json")).unwrap());

fn bytes(hex: &str) -> Vec<u8> {
    hex.as_bytes()
        .chunks(2)
        .map(|pair| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect()
}

fn rgb24(frame: &Frame, chroma: ChromaUpsampling) -> Vec<u8> {
    let mut out = vec![0; frame.pixel_count() * 3];
    Converter::with_chroma(chroma).rgb24(frame, &mut out).unwrap();
    out
}

fn grey(frame: &Frame) -> Vec<u8> {
    let mut out = vec![0; frame.pixel_count()];
    Converter::new().grey(frame, &mut out).unwrap();
    out
}

/// How often each absolute difference occurs.
fn differences(a: &[u8], b: &[u8]) -> [usize; 256] {
    assert_eq!(a.len(), b.len());
    let mut counts = [0; 256];
    for (a, b) in a.iter().zip(b) {
        counts[usize::from(a.abs_diff(*b))] += 1;
    }
    counts
}

fn largest(differences: &[usize; 256]) -> usize {
    differences.iter().rposition(|count| *count > 0).unwrap_or(0)
}

/// A frame with 5 bytes of rubbish between its rows must convert as one without.
fn padded(frame: &Frame) -> Frame {
    let row_bytes = frame.stride_bytes as usize;
    let pixels: Vec<u8> = frame.pixels.chunks(row_bytes).flat_map(|row| [row, &[0xAB; 5]].concat()).collect();
    let stride_bytes = frame.stride_bytes + 5;
    let mut padded = Frame::new(frame.format, frame.width_px, frame.height_px, stride_bytes, pixels).unwrap();
    padded.color = frame.color;
    padded
}

#[test]
fn random_yuv_is_bit_exact_against_float64() {
    for case in &PEERS.yuv {
        let mut frame = Frame::packed(case.format, PEERS.width, PEERS.height, bytes(&case.data)).unwrap();
        for expected in &case.expected {
            frame.color = ColorEncoding { matrix: expected.matrix, range: expected.range };
            let chroma = match expected.chroma.as_str() {
                "linear" => ChromaUpsampling::Linear,
                _ => ChromaUpsampling::Nearest,
            };
            let found = rgb24(&frame, chroma);
            assert_eq!(found, bytes(&expected.rgb), "{} {:?} {chroma:?}", frame.format, frame.color);
            assert_eq!(found, rgb24(&padded(&frame), chroma), "{} with padding", frame.format);
        }
    }
}

/// OpenCV rounds coefficients to 20 bits and then the result: at most one code beside the exact formula. Only pixels
/// with Y of 16 and more are compared: OpenCV lifts the others to 16 before it adds the chroma.
#[test]
fn random_yuv_is_within_a_code_of_opencv() {
    for case in &PEERS.yuv {
        let frame = Frame::packed(case.format, PEERS.width, PEERS.height, bytes(&case.data)).unwrap();
        let found = rgb24(&frame, ChromaUpsampling::Nearest);
        let opencv = bytes(&case.opencv);
        let (mut compared, mut worst) = (0, 0);
        for ((y, found), opencv) in grey(&frame).iter().zip(found.chunks(3)).zip(opencv.chunks(3)) {
            if *y >= 16 {
                compared += 1;
                worst = worst.max(largest(&differences(found, opencv)));
            }
        }
        assert!(worst <= 1 && compared > 100, "{}: {worst} over {compared} pixels", case.format);
    }
}

/// Swscale computes in 8 bit steps of 13 bit coefficients: two codes. A swapped matrix or range is off by far more.
#[test]
fn flat_colours_are_within_two_codes_of_ffmpeg() {
    for case in &PEERS.flat {
        let [y, cb, cr] = case.yuv;
        let mut frame = Frame::packed(PixelFormat::Yuyv, 2, 1, vec![y, cb, y, cr]).unwrap();
        frame.color = ColorEncoding { matrix: case.matrix, range: case.range };
        let found = rgb24(&frame, ChromaUpsampling::Linear);
        assert!(
            largest(&differences(&found[..3], &case.rgb)) <= 2,
            "{:?}: {found:?} {:?}",
            case.yuv,
            case.rgb
        );
    }
}

/// Every triple of codes against the formula in float64.
///
/// The kernel adds three products below 2⁹ in single precision: an error below 4 · 2⁹ · 2⁻²⁴ = 1.2e-4.
#[test]
fn every_code_triple_is_within_half_a_code_of_the_formula() {
    for (matrix, kr, kb) in [(YuvMatrix::Bt601, 0.299, 0.114), (YuvMatrix::Bt709, 0.2126, 0.0722)] {
        for (range, black, luma_span, chroma_span) in
            [(YuvRange::Full, 0.0, 255.0, 255.0), (YuvRange::Limited, 16.0, 219.0, 224.0)]
        {
            let mut worst = 0.0_f64;
            for cr in 0..=255_u8 {
                let row = |y: u8| (0..=255_u8).flat_map(move |cb| [y, cb, y, cr]);
                let pixels: Vec<u8> = (0..=255).step_by(3).flat_map(row).collect();
                let mut frame = Frame::packed(PixelFormat::Yuyv, 512, 86, pixels).unwrap();
                frame.color = ColorEncoding { matrix, range };
                let found = rgb24(&frame, ChromaUpsampling::Nearest);
                for (pixel, rgb) in found.as_chunks::<3>().0.iter().enumerate().step_by(2) {
                    let y = ((pixel / 512 * 3) as f64 - black) / luma_span;
                    let cb = ((pixel % 512 / 2) as f64 - 128.0) / chroma_span;
                    let cr = (f64::from(cr) - 128.0) / chroma_span;
                    let (r, b) = (y + 2.0 * (1.0 - kr) * cr, y + 2.0 * (1.0 - kb) * cb);
                    let g = (y - kr * r - kb * b) / (1.0 - kr - kb);
                    for (exact, code) in [r, g, b].into_iter().zip(rgb) {
                        worst = worst.max((255.0 * exact.clamp(0.0, 1.0) - f64::from(*code)).abs());
                    }
                }
            }
            assert!(worst <= 0.5 + 1.2e-4, "{matrix:?} {range:?}: {worst}");
            assert!(worst > 0.499, "the sweep must meet values between codes: {worst}");
        }
    }
}

/// Against libjpeg-turbo: both compute the inverse transform in integers of 12 and more bits, so a sample differs by at
/// most one code, and colour conversion (weights up to 1.772) turns one code of chroma into two; both upsample
/// linearly, but with different rounding: one code more of chroma, four in all. On average rounding alone is below half a
/// code, where chroma taken half a pixel off would not be.
#[test]
fn jpeg_agrees_with_libjpeg_turbo() {
    for case in &PEERS.jpeg {
        let frame = Frame::packed(PixelFormat::Mjpg, case.width, case.height, bytes(&case.jpeg)).unwrap();
        let name = format!("{} {} x {}", case.kind, case.width, case.height);
        let found = rgb24(&frame, ChromaUpsampling::Linear);
        let counts = differences(&found, &bytes(&case.rgb));
        assert!(largest(&counts) <= 4, "{name}: {:?}", &counts[..8]);
        let sum: usize = counts.iter().enumerate().map(|(difference, count)| difference * count).sum();
        assert!(2 * sum < found.len(), "{name}: {:?}", &counts[..8]);
        let luma = differences(&grey(&frame), &bytes(&case.luma));
        assert!(largest(&luma) <= 1, "{name}: luma {:?}", &luma[..8]);
    }
}

/// The decoder has code for several processors: a frame must not change its codes with the machine.
#[test]
fn jpeg_decodes_to_the_same_codes_with_and_without_vector_instructions() {
    use zune_jpeg::zune_core::{bytestream::ZCursor, options::DecoderOptions};
    for case in &PEERS.jpeg {
        let jpeg = bytes(&case.jpeg);
        let options = DecoderOptions::default().set_use_unsafe(false);
        let plain = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(&jpeg), options).decode().unwrap();
        let frame = Frame::packed(PixelFormat::Mjpg, case.width, case.height, jpeg).unwrap();
        assert!(rgb24(&frame, ChromaUpsampling::Linear) == plain, "{}", case.kind);
    }
}

fn jpeg_case(kind: &str) -> (Vec<u8>, u32, u32) {
    let case = PEERS.jpeg.iter().find(|case| case.kind == kind).unwrap();
    (bytes(&case.jpeg), case.width, case.height)
}

#[test]
fn jpeg_without_huffman_tables_decodes_as_with_them() {
    for kind in ["444", "422", "420", "grey"] {
        let (with, width, height) = jpeg_case(kind);
        let mut without = with.clone();
        let mut removed = 0;
        while let Some(at) = without.windows(2).position(|pair| pair == [0xFF, 0xC4]) {
            let len = 2 + usize::from(u16::from_be_bytes([without[at + 2], without[at + 3]]));
            without.drain(at..at + len);
            removed += 1;
        }
        assert!(removed > 0);
        let decode =
            |jpeg| rgb24(&Frame::packed(PixelFormat::Mjpg, width, height, jpeg).unwrap(), Default::default());
        assert_eq!(decode(with), decode(without), "{kind}");
    }
}

#[test]
fn jpeg_with_rubbish_behind_it_decodes_as_without() {
    let (jpeg, width, height) = jpeg_case("420");
    let decode =
        |jpeg| rgb24(&Frame::packed(PixelFormat::Mjpg, width, height, jpeg).unwrap(), Default::default());
    let padded = [jpeg.as_slice(), &[0; 100], &[0xFF, 0xD8, 0xFF, 0xC0]].concat();
    assert_eq!(decode(jpeg), decode(padded));
}

#[test]
fn truncated_jpeg_is_refused_wherever_it_is_cut() {
    for kind in ["422", "420 progressive", "grey"] {
        let (jpeg, width, height) = jpeg_case(kind);
        let mut out = vec![0; (width * height * 3) as usize];
        for len in 4..jpeg.len() {
            let frame = Frame::packed(PixelFormat::Mjpg, width, height, jpeg[..len].to_vec()).unwrap();
            let error = Converter::new().rgb24(&frame, &mut out).unwrap_err();
            assert_eq!(error, ConvertError::Jpeg(JpegError::Truncated(len)), "{kind} cut to {len}");
        }
    }
}

#[test]
fn jpeg_of_another_size_than_its_frame_is_refused() {
    let (jpeg, width, height) = jpeg_case("420");
    let frame = Frame::packed(PixelFormat::Mjpg, width + 1, height, jpeg).unwrap();
    let error = Converter::new().grey(&frame, &mut vec![0; frame.pixel_count()]).unwrap_err();
    assert_eq!(error.to_string(), "the JPEG image is 48 x 32 pixels, its frame 49 x 32");
}

#[test]
fn a_short_jpeg_that_claims_to_be_huge_is_refused_before_decoding() {
    let (mut jpeg, _, _) = jpeg_case("420");
    let at = jpeg.windows(2).position(|pair| pair == [0xFF, 0xC0]).unwrap();
    jpeg[at + 5..at + 9].copy_from_slice(&[0x40, 0x00, 0x40, 0x00]);
    assert!(matches!(JpegHeader::read(&jpeg), Err(JpegError::Damaged { .. })));
}

#[test]
fn sixteen_bits_become_eight_by_rounding() {
    let codes = [0_u16, 128, 129, 257, 32768, 65406, 65407, 65535];
    let pixels: Vec<u8> = codes.iter().flat_map(|code| code.to_le_bytes()).collect();
    for format in [PixelFormat::Y16, PixelFormat::Z16] {
        let frame = Frame::packed(format, 8, 1, pixels.clone()).unwrap();
        let exact: Vec<u8> = codes.iter().map(|code| (f64::from(*code) / 257.0).round() as u8).collect();
        assert_eq!(grey(&frame), exact);
        let spread: Vec<u8> = exact.iter().flat_map(|code| [*code; 3]).collect();
        assert_eq!(rgb24(&frame, ChromaUpsampling::Linear), spread);
        let mut numbers = vec![0.0; 24];
        Converter::new().rgb_f32(&frame, &mut numbers).unwrap();
        for (number, code) in numbers.as_chunks::<3>().0.iter().zip(codes) {
            assert_eq!(*number, [f32::from(code) / 65535.0; 3]);
        }
    }
}

#[test]
fn linear_light_of_any_size_is_bit_exact_against_float64() {
    let LinearCase { data, rgb } = &PEERS.linear;
    let frame = Frame::packed(PixelFormat::RgbF32, PEERS.width, PEERS.height, bytes(data)).unwrap();
    assert_eq!(rgb24(&frame, Default::default()), bytes(rgb));
    assert_eq!(rgb24(&padded(&frame), Default::default()), bytes(rgb), "with padding");
}

#[test]
fn linear_values_stay_as_numbers_and_become_srgb_to_look_at() {
    // Light of the code 128 (0.2159), of a third, of black and white, and beyond both.
    let light = [0.215_860_5, 1.0 / 3.0, 0.0, 1.0, 9.0, -0.5_f32];
    let pixels: Vec<u8> = light.iter().flat_map(|light| light.to_le_bytes()).collect();
    let frame = Frame::packed(PixelFormat::RgbF32, 2, 1, pixels).unwrap();
    let mut numbers = vec![0.0; 6];
    Converter::new().rgb_f32(&frame, &mut numbers).unwrap();
    assert_eq!(numbers, light);
    // A third: 1.055 · 3^(−1/2.4) − 0.055 = 0.6125 = 156.2 / 255.
    let codes = [128, 156, 0, 255, 255, 0];
    assert_eq!(rgb24(&frame, ChromaUpsampling::Linear), codes);
    // 0.299 · 128 + 0.587 · 156 = 129.8, and 0.299 · 255 + 0.587 · 255 = 225.9.
    assert_eq!(grey(&frame), [130, 226]);

    let mut broken = frame.clone();
    broken.pixels = [&0x7f80_0000_u32.to_le_bytes()[..], &frame.pixels[4..]].concat().into();
    let error = Converter::new().rgb24(&broken, &mut [0; 6]).unwrap_err().to_string();
    assert!(error.contains("pixel (0, 0): red is inf"), "{error}");
}

#[test]
fn numbers_give_back_the_codes_bit_for_bit() {
    let mut converter = Converter::new();
    for case in &PEERS.yuv {
        let frame = Frame::packed(case.format, PEERS.width, PEERS.height, bytes(&case.data)).unwrap();
        let mut numbers = vec![0.0_f32; frame.pixel_count() * 3];
        converter.rgb_f32(&frame, &mut numbers).unwrap();
        let codes: Vec<u8> = numbers.iter().map(|x| (x * 255.0).round() as u8).collect();
        assert_eq!(codes, rgb24(&frame, ChromaUpsampling::Linear), "{}", frame.format);
    }
}

#[test]
fn luminance_is_the_y_plane_or_the_weighted_sum() {
    let yuyv = Frame::packed(PixelFormat::Yuyv, 2, 2, vec![1, 9, 2, 9, 3, 9, 4, 9]).unwrap();
    let uyvy = Frame::packed(PixelFormat::Uyvy, 2, 2, vec![9, 1, 9, 2, 9, 3, 9, 4]).unwrap();
    let nv12 = Frame::packed(PixelFormat::Nv12, 2, 2, vec![1, 2, 3, 4, 9, 9]).unwrap();
    for frame in [yuyv, uyvy, nv12] {
        assert_eq!(grey(&frame), [1, 2, 3, 4], "{}", frame.format);
    }
    let rgb = Frame::packed(
        PixelFormat::Rgb24,
        5,
        1,
        vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 9, 9, 9, 255, 255, 255],
    );
    // 255 · 0.299 = 76.2, 255 · 0.587 = 149.7, 255 · 0.114 = 29.1
    assert_eq!(grey(&rgb.unwrap()), [76, 150, 29, 9, 255]);
}

#[test]
fn frames_from_the_pool_keep_what_is_known_and_an_empty_pool_gives_none() {
    let pool = FramePool::new(1, 0);
    let mut frame = Frame::packed(PixelFormat::Nv12, 2, 2, vec![128; 6]).unwrap();
    (frame.sequence, frame.gain) = (7, Some(2.0));
    let mut converter = Converter::new();
    let rgb = converter.rgb24_frame(&frame, &pool).unwrap().unwrap();
    assert_eq!((rgb.format, rgb.stride_bytes, rgb.sequence, rgb.gain), (PixelFormat::Rgb24, 6, 7, Some(2.0)));
    rgb.check().unwrap();
    assert!(converter.grey_frame(&frame, &pool).unwrap().is_none());
    assert_eq!(pool.dropped(), 1);
}

#[test]
fn an_output_of_the_wrong_size_is_refused() {
    let frame = Frame::packed(PixelFormat::Grey, 2, 2, vec![0; 4]).unwrap();
    let error = Converter::new().rgb24(&frame, &mut [0; 11]).unwrap_err();
    assert_eq!(error, ConvertError::Output { needed: 12, found: 11 });
}

#[test]
fn damaged_jpeg_gives_errors_or_pixels_but_never_a_panic() {
    for kind in ["422", "420 progressive", "422 restart markers", "grey"] {
        let (jpeg, width, height) = jpeg_case(kind);
        let mut out = vec![0; (width * height * 3) as usize];
        let mut refused = 0;
        for (_, damaged) in coshade_testdata::mutate::mutations(&jpeg, 500) {
            let Ok(frame) = Frame::packed(PixelFormat::Mjpg, width, height, damaged) else { continue };
            refused += usize::from(Converter::new().rgb24(&frame, &mut out).is_err());
            let _ = Converter::new().grey(&frame, &mut out[..(width * height) as usize]);
        }
        assert!(refused > 50, "{kind}: {refused} refused");
    }
}
