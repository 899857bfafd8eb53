//! Truth pictures as a session's camera: EXR in, recording, EXR out, to the bit; and what must fit them.
#![allow(clippy::unwrap_used, reason = "helpers of tests panic as tests do")]

mod support;

use std::path::Path;

use coshade_image_file::{Channel, Image, LayeredImage, Precision, read, write_exr};
use support::{coshade, workspace};

/// 24 × 18 pixels from black to far above white, layers `real` and `mixed`.
fn write_truth(path: &Path) {
    let channel = |(index, name): (usize, &str), factor: f32| Channel {
        name: name.into(),
        samples: (0..24 * 18).map(|n| (n * (index + 1)) as f32 / 97.0 * factor).collect(),
    };
    let image = |factor| {
        let channels = ["R", "G", "B"].into_iter().enumerate().map(|named| channel(named, factor));
        Image::new(24, 18, channels.collect()).unwrap()
    };
    let mut layers = LayeredImage::default();
    layers.push("real", image(1.0)).unwrap();
    layers.push("mixed", image(0.7)).unwrap();
    write_exr(path, &layers, Precision::Float).unwrap();
}

fn write_session(folder: &Path, response: &str) {
    let calibration = format!(
        "version = 1\nsize_px = [24, 18]\n{response}\n[lens]\nmodel = \"pinhole\"\nfx = 20.0\nfy = 20.0\ncx = 11.5\ncy = 8.5\n"
    );
    std::fs::write(folder.join("camera.toml"), calibration).unwrap();
    let session =
        "version = 1\n[camera]\nsource = \"images:truth.exr?layer=real\"\ncalibration = \"camera.toml\"\n";
    std::fs::write(folder.join("session.toml"), session).unwrap();
}

#[test]
fn a_truth_picture_is_a_camera_of_a_session_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    write_truth(&folder.path().join("truth.exr"));
    write_session(folder.path(), "response = { kind = \"linear\" }");
    let run = |args: &str| coshade(folder.path(), args);

    run("info session.toml").success();
    run("record session.toml -o r.mcap").success();
    let info = run("info r.mcap --json").success().json();
    let stream = &info["content"]["streams"][0];
    assert_eq!((stream["format"].as_str(), stream["calibration"].as_bool()), (Some("rgbf32"), Some(true)));
    run("replay r.mcap --rate max --export out").success();
    let exported = read(folder.path().join("out/camera/000000.exr")).unwrap();
    let truth = read(folder.path().join("truth.exr")).unwrap();
    assert_eq!(exported.layers[0].image.channels(), truth.layer("real").unwrap().channels());
    let same = run("compare out/camera/000000.exr truth.exr#real --json").success().json();
    assert_eq!(same["identical"], true);
}

#[test]
fn a_response_that_is_not_linear_is_refused_with_both_named() {
    let folder = tempfile::tempdir().unwrap();
    write_truth(&folder.path().join("truth.exr"));
    write_session(folder.path(), "");
    for args in ["record session.toml -o r.mcap", "info session.toml"] {
        let refused = coshade(folder.path(), args).failure(if args.starts_with("record") { 2 } else { 1 });
        let said = refused.stdout + &refused.stderr;
        for part in ["camera.toml", "truth.exr", "RGBF32", "`srgb`", "kind = \"linear\""] {
            assert!(said.contains(part), "{args}: {part}: {said}");
        }
    }
}

#[test]
fn folders_and_files_of_light_are_described() {
    let folder = tempfile::tempdir().unwrap();
    let exr = workspace("image-file/tests/data/exr");
    std::fs::create_dir(folder.path().join("light")).unwrap();
    for name in ["0.exr", "1.exr"] {
        std::fs::copy(exr.join("zip.exr"), folder.path().join("light").join(name)).unwrap();
    }
    let info = coshade(folder.path(), "info light --json").success().json();
    let series = &info["content"]["series"][0];
    assert_eq!((series["format"].as_str(), series["frames"].as_u64()), (Some("rgbf32"), Some(2)));
    assert!(series["uri"].as_str().unwrap().ends_with("light/*.exr"), "{series}");
    let single = coshade(folder.path(), "info light/0.exr").success().stdout;
    assert!(single.contains("37x23 px") && single.contains("values are linear, 1 = white"), "{single}");
}
