//! What is a frame and what is not.

use coshade_capture::{DepthFrame, Frame, FrameError, PixelFormat};
use coshade_lens::calibration::Response;
use proptest::prelude::*;

const FORMATS: [PixelFormat; 9] = [
    PixelFormat::Yuyv,
    PixelFormat::Uyvy,
    PixelFormat::Nv12,
    PixelFormat::Grey,
    PixelFormat::Y16,
    PixelFormat::Z16,
    PixelFormat::Rgb24,
    PixelFormat::RgbF32,
    PixelFormat::Mjpg,
];

#[test]
fn the_last_row_needs_no_padding_and_not_a_byte_less() {
    // Width 4, height 2, stride 48: one full stride and one row; NV12 has a third row for chroma.
    for (format, needed) in [
        (PixelFormat::Grey, 48 + 4),
        (PixelFormat::Yuyv, 48 + 8),
        (PixelFormat::Uyvy, 48 + 8),
        (PixelFormat::Y16, 48 + 8),
        (PixelFormat::Z16, 48 + 8),
        (PixelFormat::Rgb24, 48 + 12),
        (PixelFormat::RgbF32, 48 + 48),
        (PixelFormat::Nv12, 96 + 4),
    ] {
        assert!(Frame::new(format, 4, 2, 48, vec![0; needed]).is_ok(), "{format}");
        let error = Frame::new(format, 4, 2, 48, vec![0; needed - 1]).unwrap_err();
        assert!(
            matches!(error, FrameError::TooShort { needed_bytes, .. } if needed_bytes == needed as u64),
            "{error}"
        );
    }
}

#[test]
fn sizes_of_nothing_and_of_absurdity_are_refused() {
    for (width_px, height_px) in [(0, 4), (4, 0), (16_385, 1), (1, 16_385), (u32::MAX, u32::MAX)] {
        for format in FORMATS {
            let error = Frame::packed(format, width_px, height_px, vec![0; 64]).unwrap_err();
            assert_eq!(error, FrameError::Size { width_px, height_px });
        }
    }
}

#[test]
fn half_a_pair_of_pixels_is_refused_where_pairs_share_chroma() {
    let error = Frame::packed(PixelFormat::Yuyv, 3, 2, vec![0; 64]).unwrap_err();
    assert_eq!(error.to_string(), "a YUYV frame of 3 x 2 pixels: the width must be even, crop the image");
    assert!(matches!(Frame::packed(PixelFormat::Nv12, 4, 3, vec![0; 64]), Err(FrameError::OddSize { .. })));
    assert!(Frame::packed(PixelFormat::Uyvy, 2, 3, vec![0; 12]).is_ok());
    assert!(Frame::packed(PixelFormat::Rgb24, 3, 3, vec![0; 27]).is_ok());
}

#[test]
fn overlapping_rows_and_strides_of_compressed_frames_are_refused() {
    assert!(matches!(Frame::new(PixelFormat::Rgb24, 4, 2, 11, vec![0; 64]), Err(FrameError::Stride { .. })));
    assert!(matches!(Frame::new(PixelFormat::Mjpg, 4, 2, 4, vec![0; 64]), Err(FrameError::Stride { .. })));
}

#[test]
fn rows_are_cut_where_the_stride_says() {
    let frame = Frame::new(PixelFormat::Nv12, 2, 2, 3, vec![1, 2, 0, 3, 4, 0, 5, 6]).unwrap();
    assert_eq!(frame.row(0), Some(&[1, 2][..]));
    assert_eq!(frame.row(1), Some(&[3, 4][..]));
    assert_eq!(frame.row(2), None);
    assert_eq!(frame.chroma_row(0), Some(&[5, 6][..]));
    assert_eq!(frame.chroma_row(1), None);
}

fn linear(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[test]
fn linear_values_are_read_wherever_rows_begin_and_must_be_finite() {
    // Two rows of two pixels, a byte of padding between the rows.
    let values = [0.0, -1e-40, 1.0, 7.5, f32::MAX, f32::MIN];
    let pixels = [linear(&values), vec![0xff], linear(&values.map(|value| value / 2.0))].concat();
    let frame = Frame::new(PixelFormat::RgbF32, 2, 2, 25, pixels.clone()).unwrap();
    assert_eq!(frame.rgb_f32_row(0).collect::<Vec<_>>(), [[0.0, -1e-40, 1.0], [7.5, f32::MAX, f32::MIN]]);
    assert_eq!(frame.rgb_f32_row(1).nth(1), Some([3.75, f32::MAX / 2.0, f32::MIN / 2.0]));
    assert_eq!(frame.rgb_f32_row(2).count(), 0);

    for (at, value, message) in [
        (0, f32::NAN, "pixel (0, 0): red is NaN; a RGBF32 frame holds finite values only"),
        (20, f32::NEG_INFINITY, "pixel (1, 0): blue is -inf"),
        (25 + 16, f32::INFINITY, "pixel (1, 1): green is inf"),
    ] {
        let mut damaged = pixels.clone();
        damaged[at..at + 4].copy_from_slice(&value.to_le_bytes());
        let error = Frame::new(PixelFormat::RgbF32, 2, 2, 25, damaged.clone()).unwrap_err();
        assert!(error.to_string().starts_with(message), "{error}");
    }
    let bytes = Frame::packed(PixelFormat::Grey, 12, 1, vec![0; 12]).unwrap();
    assert_eq!(bytes.rgb_f32_row(0).count(), 0, "bytes are no linear values");
}

#[test]
fn linear_frames_want_a_linear_response() {
    let mismatch = PixelFormat::RgbF32.check_response(&Response::Rec709).unwrap_err();
    assert_eq!((mismatch.format, mismatch.response), (PixelFormat::RgbF32, "rec709"));
    for (format, response) in [
        (PixelFormat::RgbF32, Response::Linear),
        (PixelFormat::RgbF32, Response::Gamma { gamma: 1.0 }),
        (PixelFormat::Rgb24, Response::Linear),
        (PixelFormat::Mjpg, Response::Srgb),
    ] {
        format.check_response(&response).unwrap();
    }
}

#[test]
fn depth_is_counts_times_unit_and_zero_is_nothing() {
    let pixels = [0_u16, 5000, 1, 65535].iter().flat_map(|code| code.to_le_bytes()).collect::<Vec<_>>();
    let mut frame = Frame::packed(PixelFormat::Z16, 2, 2, pixels).unwrap();
    assert!(matches!(DepthFrame::try_from(frame.clone()), Err(FrameError::DepthUnit(None))));
    for unit in [0.0, -0.001, f64::NAN, f64::INFINITY] {
        frame.depth_unit_m = Some(unit);
        assert!(matches!(DepthFrame::try_from(frame.clone()), Err(FrameError::DepthUnit(Some(_)))), "{unit}");
    }
    frame.depth_unit_m = Some(0.0002);
    let depth = DepthFrame::try_from(frame.clone()).unwrap();
    assert_eq!(depth.unit_m(), 0.0002);
    assert_eq!((depth.depth_m(0, 0), depth.depth_m(1, 0)), (None, Some(1.0)));
    assert_eq!(depth.depth_m(1, 1), Some(65535.0 * 0.0002));
    assert_eq!(
        (depth.depth_m(2, 0), depth.depth_m(0, 2), depth.depth_m(u32::MAX, u32::MAX)),
        (None, None, None)
    );
    assert_eq!(depth.row_codes(1).collect::<Vec<_>>(), [1, 65535]);

    frame.format = PixelFormat::Y16;
    assert_eq!(DepthFrame::try_from(frame).unwrap_err(), FrameError::NotDepth(PixelFormat::Y16));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the numbers, a frame is refused or all of its rows can be read.
    #[test]
    fn accepted_frames_have_all_their_rows(
        format in prop::sample::select(FORMATS.to_vec()),
        width_px in 0_u32..40, height_px in 0_u32..40, stride_bytes in prop_oneof![0_u32..200, any::<u32>()],
        len in 0_usize..6000,
    ) {
        if let Ok(frame) = Frame::new(format, width_px, height_px, stride_bytes, vec![0; len]) {
            let readable = (0..height_px).all(|y| frame.row(y).is_some());
            prop_assert_eq!(readable, format != PixelFormat::Mjpg);
            if format == PixelFormat::Nv12 {
                prop_assert!((0..height_px / 2).all(|y| frame.chroma_row(y).is_some()));
            }
        }
    }
}
