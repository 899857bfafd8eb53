//! EXR: files of the reference implementation, and what is written here read back.
#![allow(clippy::unwrap_used, reason = "helpers of tests panic as tests do")]

use std::path::{Path, PathBuf};

use coshade_image_file::{
    Channel, Image, ImageError, ImageSpec, Layer, LayerOutline, LayeredImage, Precision, ReadLimits, outline,
    read, read_bytes, read_with_limits, write_exr,
};
use glam::Vec3;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/exr")
}

#[test]
fn every_kind_of_file_reads_as_openexr_reads_it() {
    let expected = std::fs::read_to_string(folder().join("expected.json")).unwrap();
    let expected: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&expected).unwrap();
    assert_eq!(expected.len(), 14);
    for (name, channels) in expected {
        let file = read(folder().join(&name)).unwrap();
        for (full_name, figures) in channels.as_object().unwrap() {
            // OpenEXR's file has parts "beauty" and "depth"; a part's name is the layer's.
            let spec = ImageSpec { path: name.clone().into(), layer: Some(full_name.clone()) };
            let image = spec.select(&file).unwrap();
            let samples = &image.channels()[0].samples;
            let sum: f64 = samples.iter().map(|&sample| f64::from(sample)).sum();
            let ours = [
                image.width() as f64,
                image.height() as f64,
                sum,
                f64::from(samples[0]),
                f64::from(*samples.last().unwrap()),
            ];
            let theirs: Vec<f64> = figures.as_array().unwrap().iter().map(|f| f.as_f64().unwrap()).collect();
            // Samples are multiples of 1/16, so that every sum is exact.
            assert_eq!(ours.as_slice(), theirs, "{name} {full_name}");
        }
    }
}

#[test]
fn an_outline_is_what_reading_gives_and_needs_the_header_only() {
    let files = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let exr: Vec<PathBuf> = files.filter(|path| path.extension().is_some_and(|e| e == "exr")).collect();
    assert_eq!(exr.len(), 14);
    for path in exr {
        let bytes = std::fs::read(&path).unwrap();
        let limits = ReadLimits::default();
        let outlined = |Layer { name, image }: &Layer| LayerOutline {
            name: name.clone(),
            width: image.width(),
            height: image.height(),
            channels: image.channel_names().into_iter().map(str::to_owned).collect(),
            window: image.window(),
        };
        let expected: Vec<LayerOutline> = read(&path).unwrap().layers.iter().map(outlined).collect();
        assert_eq!(outline(&path, &bytes, &limits).unwrap(), expected, "{}", path.display());
        // 37 x 23 samples of 2 bytes take more than the last 40 bytes, however packed.
        assert_eq!(outline(&path, &bytes[..bytes.len() - 40], &limits).unwrap(), expected);
        assert!(outline(&path, &bytes[..100], &limits).is_err());
    }
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 7 +X 5\n";
    let outlined = outline(Path::new("x.hdr"), hdr, &ReadLimits::default()).unwrap().remove(0);
    assert_eq!((outlined.width, outlined.height, outlined.channels.concat().as_str()), (5, 7, "RGB"));
    assert!(outline(Path::new("x.png"), b"\x89PNG", &ReadLimits::default()).is_err());
}

#[test]
fn layers_and_channel_order() {
    let file = read(folder().join("layers.exr")).unwrap();
    let names: Vec<&str> = file.layers.iter().map(|layer| layer.name.as_str()).collect();
    assert_eq!(names, ["depth_z_m", "mixed", "normal", "real"]);
    assert_eq!(file.layer("real").unwrap().channel_names(), ["R", "G", "B"]);
    assert_eq!(file.layer("normal").unwrap().channel_names(), ["X", "Y", "Z"]);
    let file = read(folder().join("alpha_depth_id.exr")).unwrap();
    assert_eq!(file.layer("").unwrap().channel_names(), ["R", "G", "B", "A", "Z", "id"]);
}

#[test]
fn the_data_window_is_kept() {
    let file = read(folder().join("window.exr")).unwrap();
    let window = file.layers[0].image.window().unwrap();
    assert_eq!((window.data_origin_px, window.display_origin_px), ([-5, 12], [0, 0]));
    assert_eq!(window.display_size_px, [64, 48]);
}

#[test]
fn a_missing_layer_names_those_that_are_there() {
    let path = folder().join("layers.exr");
    let text = |layer: &str| format!("{}{layer}", path.display());
    let select = |layer: &str| ImageSpec::parse(&text(layer)).select(&read(&path).unwrap());
    assert_eq!(select("#real").unwrap().channels().len(), 3);
    assert_eq!(select("#real.G").unwrap().channel_names(), ["G"]);
    for layer in ["#unreal", ""] {
        let message = select(layer).unwrap_err().to_string();
        assert!(message.contains("layers.exr") && message.contains("depth_z_m [Z]"), "{message}");
    }
}

#[test]
fn subsampled_channels_are_refused_by_name() {
    let mut bytes = std::fs::read(folder().join("none.exr")).unwrap();
    // In the channel list: name, 0, type (4 bytes), linearity (4), x sampling (4), y sampling (4).
    let entry = b"B\0\x01\0\0\0";
    let at = bytes.windows(entry.len()).position(|window| window == entry).unwrap() + 10;
    assert_eq!(bytes[at..at + 8], [1, 0, 0, 0, 1, 0, 0, 0]);
    bytes[at] = 2;
    bytes[at + 4] = 2;
    let message =
        read_bytes(Path::new("chroma.exr"), &bytes, &ReadLimits::default()).unwrap_err().to_string();
    assert!(message.contains("chroma.exr") && message.contains("channel B"), "{message}");
}

#[test]
fn limits_hold_before_anything_is_decoded() {
    let limits = ReadLimits { max_decoded_bytes: 37 * 23 * 3 * 4, ..ReadLimits::default() };
    // The file itself may not be longer than the limit either; zip.exr is.
    read_with_limits(folder().join("zip.exr"), &limits).unwrap();
    let tight = ReadLimits { max_decoded_bytes: limits.max_decoded_bytes - 1, ..limits };
    let error = read_with_limits(folder().join("zip.exr"), &tight).unwrap_err();
    assert!(matches!(error, ImageError::TooLarge { width: 37, height: 23, channels: 3, .. }), "{error}");
    let narrow = ReadLimits { max_side_px: 36, ..ReadLimits::default() };
    assert!(read_with_limits(folder().join("zip.exr"), &narrow).is_err());
}

#[test]
fn truncated_files_are_errors() {
    let bytes = std::fs::read(folder().join("zip.exr")).unwrap();
    for length in (0..bytes.len()).step_by(7) {
        assert!(
            read_bytes(Path::new("cut.exr"), &bytes[..length], &ReadLimits::default()).is_err(),
            "{length}"
        );
    }
}

fn truth() -> LayeredImage {
    let (width, height) = (19, 11);
    let value = |i: usize, scale: f32| Vec3::new(i as f32, -0.37 * i as f32, 1.0 / (1.0 + i as f32)) * scale;
    let vectors = |scale| (0..width * height).map(|i| value(i, scale)).collect::<Vec<_>>();
    let plane = |scale: f32| (0..width * height).map(|i| (i as f32).sin() * scale).collect::<Vec<_>>();
    let mut file = LayeredImage::default();
    for name in ["real", "mixed", "difference", "albedo", "variance"] {
        file.push(name, Image::from_rgb(width, height, &vectors(0.01)).unwrap()).unwrap();
    }
    file.push("normal", Image::from_xyz(width, height, &vectors(1.0)).unwrap()).unwrap();
    file.push("depth_z_m", Image::from_plane(width, height, "Z", plane(3.0)).unwrap()).unwrap();
    file.push("coverage", Image::from_plane(width, height, "Y", plane(1.0)).unwrap()).unwrap();
    file
}

#[test]
fn layers_survive_a_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth.exr");
    let file = truth();
    for precision in [Precision::Float, Precision::HalfColour, Precision::Half] {
        write_exr(&path, &file, precision).unwrap();
        let back = read(&path).unwrap();
        assert_eq!(back.layers.len(), file.layers.len());
        for layer in &file.layers {
            let back = back.layer(&layer.name).unwrap();
            let exact = match precision {
                Precision::Float => true,
                Precision::HalfColour => ["normal", "depth_z_m"].contains(&layer.name.as_str()),
                Precision::Half => false,
            };
            assert_eq!(back.channel_names(), layer.image.channel_names());
            for (a, b) in layer.image.channels().iter().zip(back.channels()) {
                for (a, b) in a.samples.iter().zip(&b.samples) {
                    // Half floats: 11 bits of mantissa, 2^-25 at least.
                    let bound = if exact { 0.0 } else { a.abs() / 2048.0 + 2f32.powi(-25) };
                    assert!((a - b).abs() <= bound, "{precision:?} {}: {a} {b}", layer.name);
                }
            }
        }
    }
}

#[test]
fn nan_and_infinity_are_kept_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.exr");
    let image = Image::from_plane(2, 2, "Y", vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0]).unwrap();
    write_exr(&path, &LayeredImage::single(image), Precision::Half).unwrap();
    let back = read(&path).unwrap();
    let census = back.layers[0].image.census();
    assert_eq!((census.nan, census.infinite, census.negative), (1, 2, 1));
    assert!(back.notes[0].contains("1 NaN and 2 infinite"), "{:?}", back.notes);
}

#[test]
fn what_half_floats_cannot_hold_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sun.exr");
    let file = LayeredImage::single(Image::from_plane(1, 1, "Y", vec![1e5]).unwrap());
    let message = write_exr(&path, &file, Precision::Half).unwrap_err().to_string();
    assert!(message.contains("sun.exr") && message.contains("65504"), "{message}");
    write_exr(&path, &file, Precision::Float).unwrap();
    assert_eq!(read(&path).unwrap().layers[0].image.channel("Y").unwrap(), [1e5]);
}

#[test]
fn images_that_do_not_fit_are_refused() {
    let channel = |name: &str, length| Channel { name: name.into(), samples: vec![0.0; length] };
    assert!(Image::new(2, 2, vec![channel("Y", 3)]).is_err());
    assert!(Image::new(2, 2, vec![channel("Y", 4), channel("Y", 4)]).is_err());
    assert!(Image::new(0, 2, vec![channel("Y", 0)]).is_err());
    assert!(Image::new(2, 2, vec![]).is_err());
    assert!(Image::new(usize::MAX, 2, vec![channel("Y", 4)]).is_err());
}
