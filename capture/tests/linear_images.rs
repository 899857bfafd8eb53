//! EXR and Radiance HDR files as cameras: the light in the file, to the bit.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests panic as tests do")]

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use coshade_capture::images::describe;
use coshade_capture::recording::{Compression, RecordingOptions, RecordingWriter};
use coshade_capture::{CaptureError, Converter, Frame, PixelFormat, open};
use coshade_image_file::{Channel, Image, LayeredImage, Precision, srgb, write_exr};
use support::assert_same;

const SOON: Duration = Duration::from_secs(5);

/// Files that OpenEXR wrote (`make_exr.py` beside them).
fn openexr(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../image-file/tests/data/exr").join(name)
}

/// What `make_exr.py` puts into the channels whose seeds begin with `seed`.
fn expected(seed: usize) -> Vec<[f32; 3]> {
    let value = |x: usize, y: usize, seed: usize| ((x * 3 + y * 7 + seed * 11) % 64) as f32 / 16.0;
    let pixels = (0..23).flat_map(|y| (0..37).map(move |x| (x, y)));
    pixels.map(|(x, y)| [0, 1, 2].map(|channel| value(x, y, seed + channel))).collect()
}

fn uri(path: &Path, options: &str) -> String {
    format!("images:{}?pace=fast{options}", path.display())
}

fn first(uri: &str) -> Result<Frame, CaptureError> {
    open(uri)?.next_frame(SOON)
}

fn error(uri: &str) -> String {
    first(uri).unwrap_err().to_string()
}

fn pixels(frame: &Frame) -> Vec<[f32; 3]> {
    (0..frame.height_px).flat_map(|y| frame.rgb_f32_row(y)).collect()
}

/// Writes planes as an EXR of one row.
fn write(path: &Path, planes: &[(&str, &[f32])]) {
    let channel =
        |(name, samples): &(&str, &[f32])| Channel { name: (*name).into(), samples: samples.to_vec() };
    let image = Image::new(planes[0].1.len(), 1, planes.iter().map(channel).collect()).unwrap();
    write_exr(path, &LayeredImage::single(image), Precision::Float).unwrap();
}

#[test]
fn files_of_openexr_are_played_to_the_bit() {
    // Half and float, odd sizes, scan lines and tiles, with and without other channels.
    for name in ["none", "rle", "zips", "zip", "piz", "float_piz", "tiled", "alpha_depth_id"] {
        let frame = first(&uri(&openexr(&format!("{name}.exr")), "")).unwrap();
        assert_eq!((frame.format, frame.width_px, frame.height_px), (PixelFormat::RgbF32, 37, 23), "{name}");
        assert_eq!(pixels(&frame), expected(0), "{name}");
    }
}

#[test]
fn layers_are_chosen_by_name() {
    let layers = openexr("layers.exr");
    assert_eq!(pixels(&first(&uri(&layers, "&layer=real")).unwrap()), expected(0));
    assert_eq!(pixels(&first(&uri(&layers, "&layer=mixed")).unwrap()), expected(3));
    assert_eq!(pixels(&first(&uri(&openexr("parts.exr"), "&layer=beauty")).unwrap()), expected(0));
    for (file, options, message) in [
        ("layers.exr", "", "there are several layers: add layer=NAME, where NAME is one of mixed, real"),
        (
            "layers.exr",
            "&layer=unreal",
            "there is no layer `unreal`: add layer=NAME, where NAME is one of mixed, real",
        ),
        ("layers.exr", "&layer=normal", "layer `normal` has channels X Y Z, a picture has R G B or Y"),
        ("layers.exr", "&layer=depth_z_m", "layer `depth_z_m` has channels Z, a picture"),
        ("zip.exr", "&layer=real", "there is no layer `real`, and none with a name"),
        (
            "window.exr",
            "",
            "the data window (37 x 23 pixels at (-5, 12)) is not the display window (64 x 48)",
        ),
        ("zip.exr", "&depth_unit_m=0.001", "depth must be 16 bit grey, the file is RGBF32"),
    ] {
        let error = error(&uri(&openexr(file), options));
        assert!(error.contains(file) && error.contains(message), "{error}");
        assert!(error.matches(&format!("{file}: ")).count() <= 1, "{error}");
    }
    let png = openexr("../../../../reference/tests/data/pairs/noise_a.png");
    let error = error(&uri(&png, "&layer=real"));
    assert!(error.contains("noise_a.png: no EXR image, and others have no layers"), "{error}");
}

#[test]
fn a_single_channel_is_a_picture_if_it_is_luminance() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    write(&path, &[("Y", &[0.25, 70_000.0]), ("A", &[0.5, 0.5])]);
    assert_eq!(pixels(&first(&uri(&path, "")).unwrap()), [[0.25; 3], [70_000.0; 3]]);
    write(&path, &[("Z", &[0.25, 2.0])]);
    assert!(error(&uri(&path, "")).contains("x.exr: the image has channels Z"));
}

#[test]
fn light_is_not_clipped_and_must_be_finite() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    let (red, green, blue) = ([1e-42, -3.0, 0.5], [f32::MAX, 2.0, 0.5], [0.0, 1.0, 0.5]);
    write(&path, &[("R", &red), ("G", &green), ("B", &blue)]);
    let frame = first(&uri(&path, "")).unwrap();
    assert_eq!(pixels(&frame), [0, 1, 2].map(|x: usize| [red[x], green[x], blue[x]]));

    let codes =
        [0, 1, 2].map(|x: usize| [red[x], green[x], blue[x]].map(|v| srgb::encode_to_code(v, 255) as u8));
    assert_eq!(first(&uri(&path, "&as=rgb")).unwrap().pixels[..], *codes.as_flattened());
    let grey = first(&uri(&path, "&as=grey")).unwrap();
    let mut converted = [0; 3];
    Converter::new().grey(&frame, &mut converted).unwrap();
    assert_eq!((grey.format, &grey.pixels[..]), (PixelFormat::Grey, &converted[..]));

    write(&path, &[("R", &red), ("G", &[0.0, 1.0, f32::NAN]), ("B", &blue)]);
    match first(&uri(&path, "")).unwrap_err() {
        CaptureError::Damaged { sequence: 0, reason, .. } => {
            assert!(
                reason
                    .ends_with("x.exr: pixel (2, 0): green is NaN; a RGBF32 frame holds finite values only"),
                "{reason}"
            );
        }
        other => panic!("{other}"),
    }
}

#[test]
fn radiance_files_are_played() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.hdr");
    // Mantissa · 2^(exponent − 136).
    let pixels_rgbe = [[1, 2, 3, 136], [255, 0, 128, 137], [10, 10, 10, 0], [64, 0, 0, 128]];
    let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n";
    fs::write(&path, [&header[..], pixels_rgbe.as_flattened()].concat()).unwrap();
    let frame = first(&uri(&path, "")).unwrap();
    let light = [[1.0, 2.0, 3.0], [510.0, 0.0, 256.0], [0.0; 3], [0.25, 0.0, 0.0]];
    assert_eq!((frame.width_px, frame.height_px, pixels(&frame)), (2, 2, light.to_vec()));
}

#[test]
fn a_recording_gives_back_the_light_of_the_files() {
    let folder = tempfile::tempdir().unwrap();
    for (n, gain) in [1.0_f32, 1.5, 100.0].iter().enumerate() {
        let row = [0.1 * gain, 1.0 / 3.0 * gain, f32::MIN_POSITIVE, -0.0, 1e30];
        write(&folder.path().join(format!("{n}.exr")), &[("R", &row), ("G", &row), ("B", &row)]);
    }
    let mut camera = open(&uri(folder.path(), "&fps=25")).unwrap();
    let played: Vec<Frame> = std::iter::from_fn(|| camera.next_frame(SOON).ok()).collect();
    assert_eq!(played.len(), 3);
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let path = folder.path().join(format!("{compression:?}.mcap"));
        let options = RecordingOptions { compression, ..RecordingOptions::default() };
        let mut writer = RecordingWriter::create(&path, options).unwrap();
        let stream = writer.add_stream("camera", None, Some(25.0)).unwrap();
        played.iter().for_each(|frame| writer.write(stream, frame, 0).unwrap());
        writer.finish(&[0]).unwrap();
        let mut replayed = open(&format!("replay:{}#camera?rate=max", path.display())).unwrap();
        assert_eq!(replayed.stream().format, PixelFormat::RgbF32);
        for frame in &played {
            let replayed = replayed.next_frame(SOON).unwrap();
            assert_same(&Frame { captured: frame.captured, arrived: frame.arrived, ..replayed }, frame);
        }
    }
}

#[test]
fn folders_of_them_are_described_and_not_mixed_with_codes() {
    let folder = tempfile::tempdir().unwrap();
    for n in 0..3 {
        write(&folder.path().join(format!("{n}.exr")), &[("R", &[0.5]), ("G", &[0.5]), ("B", &[0.5])]);
    }
    let found = describe(folder.path(), None).unwrap();
    assert!(found.problems.is_empty(), "{:?}", found.problems);
    assert_eq!(found.series[0].line(), "3 x RGBF32 1 x 1 px");
    assert_eq!(first(&format!("{}?pace=fast", found.series[0].uri)).unwrap().format, PixelFormat::RgbF32);

    image::GrayImage::new(1, 1).save(folder.path().join("9.png")).unwrap();
    let error = error(&uri(folder.path(), ""));
    assert!(
        error.contains("9.png is GREY of 1 x 1 pixels, but") && error.contains("0.exr is RGBF32"),
        "{error}"
    );

    fs::copy(openexr("layers.exr"), folder.path().join("truth.exr")).unwrap();
    let problems = describe(folder.path(), None).unwrap().problems;
    assert!(problems[0].contains("truth.exr: there are several layers: add layer=NAME"), "{problems:?}");
}
