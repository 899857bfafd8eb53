//! PNG and JPEG: bit depths, alpha, the sRGB curve, and what cannot be written.
#![allow(clippy::unwrap_used, reason = "helpers of tests panic as tests do")]

use std::path::Path;

use coshade_image_file::{BitDepth, Channel, Image, ReadLimits, read, read_bytes, srgb, write_png};

fn ramp(names: &[&str]) -> Image {
    let samples = |index: usize| (0..256).map(|i| ((i + index * 40) % 256) as f32 / 255.0).collect();
    let channel = |(index, name): (usize, &&str)| Channel { name: (*name).into(), samples: samples(index) };
    Image::new(16, 16, names.iter().enumerate().map(channel).collect()).unwrap()
}

#[test]
fn png_round_trips_within_half_a_code() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ramp.png");
    for names in [&["Y"][..], &["Y", "A"], &["R", "G", "B"], &["R", "G", "B", "A"]] {
        for (depth, codes) in [(BitDepth::Eight, 255.0), (BitDepth::Sixteen, 65535.0)] {
            let image = ramp(names);
            write_png(&path, &image, depth).unwrap();
            let back = read(&path).unwrap().layers.remove(0).image;
            assert_eq!(back.channel_names(), names);
            for (a, b) in image.channels().iter().zip(back.channels()) {
                for (&before, &after) in a.samples.iter().zip(&b.samples) {
                    let code = |value: f32| match a.name.as_str() {
                        "A" => f64::from(value),
                        _ => srgb::encode(f64::from(value)),
                    };
                    // Half a code, and the rounding of f32.
                    let bound = 0.5 / codes + 1e-6;
                    assert!(
                        (code(before) - code(after)).abs() <= bound,
                        "{names:?} {depth:?} {before} {after}"
                    );
                }
            }
        }
    }
}

#[test]
fn png_clips_and_says_what_it_cannot_hold() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.png");
    let plane = |name: &str, samples: Vec<f32>| Image::from_plane(samples.len(), 1, name, samples).unwrap();
    write_png(&path, &plane("Y", vec![-1.0, 7.0, f32::INFINITY]), BitDepth::Eight).unwrap();
    assert_eq!(read(&path).unwrap().layers[0].image.channel("Y").unwrap(), [0.0, 1.0, 1.0]);
    let message = write_png(&path, &plane("Y", vec![f32::NAN]), BitDepth::Eight).unwrap_err().to_string();
    assert!(message.contains("x.png") && message.contains("1 samples are NaN"), "{message}");
    let message = write_png(&path, &plane("Z", vec![1.0]), BitDepth::Eight).unwrap_err().to_string();
    assert!(message.contains("not Z"), "{message}");
}

#[test]
fn jpegs_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    // The picture is (4x, 6y, xy mod 256) in sRGB codes. JPEG is lossy and subsamples chroma: the mean of a channel
    // (110 and 117 by the formula) is off by far less than a pixel.
    for name in ["small.jpg", "small_progressive.jpg"] {
        let image = read(folder.join(name)).unwrap().layers.remove(0).image;
        assert_eq!((image.width(), image.height()), (56, 40));
        for (channel, expected) in [("R", 4.0 * 27.5), ("G", 6.0 * 19.5)] {
            let codes = image.channel(channel).unwrap().iter().map(|&v| 255.0 * srgb::encode(f64::from(v)));
            let mean = codes.sum::<f64>() / (56.0 * 40.0);
            assert!((mean - expected).abs() < 2.0, "{name} {channel}: {mean} {expected}");
        }
    }
}

#[test]
fn files_that_are_no_images_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notes.png");
    std::fs::write(&path, "hello, world").unwrap();
    let message = read(&path).unwrap_err().to_string();
    assert!(message.contains("notes.png") && message.contains("68 65 6c 6c"), "{message}");
    std::fs::write(&path, "").unwrap();
    assert!(read(&path).unwrap_err().to_string().contains("an empty file"));
    assert!(read(folder.path()).unwrap_err().to_string().contains("not a regular file"));
    assert!(read(folder.path().join("none.exr")).unwrap_err().to_string().contains("none.exr"));
    let tiny = ReadLimits { max_decoded_bytes: 4, ..ReadLimits::default() };
    assert!(read_bytes(&path, b"#?RADIANCE\n\n-Y 1 +X 1\nabcd", &tiny).is_err());
}
