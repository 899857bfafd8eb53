//! The command line, as a user runs it: simulated frames are recorded, looked at, replayed, exported, compared.

mod support;

use serde_json::Value;
use support::{Run, coshade, gradient_frames, workspace};

#[test]
fn what_is_recorded_is_replayed_and_exported_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("camera"), 20, [64, 48]);
    gradient_frames(&folder.path().join("fisheye"), 10, [32, 32]);
    let run = |args: &str| coshade(folder.path(), args);

    let recorded = run("record --source camera=images:camera/*.png?fps=100 --source fisheye=images:fisheye/*.png?fps=50 \
                        -o r.mcap --json")
    .success();
    let recorded = recorded.json();
    assert_eq!(recorded["streams"][0]["written"], 20);
    assert_eq!(recorded["streams"][1]["written"], 10);

    let info = run("info r.mcap --json").success().json();
    assert_eq!(info["kind"], "recording");
    assert_eq!(info["problems"], Value::Array(vec![]));
    let streams = info["content"]["streams"].as_array().unwrap();
    let names: Vec<_> = streams.iter().map(|stream| stream["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["camera", "fisheye"]);

    let replayed = run("replay r.mcap --rate max --export out --json").success().json();
    assert_eq!(replayed["streams"][0]["frames"], 20);
    for index in [0, 7, 19] {
        let name = format!("camera/{index:04}.png");
        let original = image::open(folder.path().join(name)).unwrap().into_rgb8();
        let exported = image::open(folder.path().join(format!("out/camera/{index:06}.png"))).unwrap().into_rgb8();
        assert!(original == exported, "frame {index} came back changed");
    }
    let same = run("compare out/camera/000003.png camera/0003.png --json").success().json();
    assert_eq!(same["identical"], true);
}

#[test]
fn a_session_is_recorded_with_its_calibrations() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("camera"), 5, [64, 36]);
    std::fs::copy(workspace("lens/tests/data/camera.toml"), folder.path().join("camera.toml")).unwrap();
    let session = "version = 1\n[camera]\nsource = \"images:camera/*.png?fps=100\"\ncalibration = \"camera.toml\"\n";
    std::fs::write(folder.path().join("session.toml"), session).unwrap();

    let recorded = coshade(folder.path(), "record session.toml -o r.mcap").success();
    assert!(recorded.stderr.contains("binning"), "scaling a calibration is said: {}", recorded.stderr);
    let info = coshade(folder.path(), "info r.mcap --json").success().json();
    assert_eq!(info["content"]["streams"][0]["calibration"], true);
    assert_eq!(info["content"]["session"]["session"], session);
}

#[test]
fn an_existing_recording_is_not_overwritten_unless_told() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("camera"), 2, [16, 16]);
    let record = "record --source camera=images:camera/*.png?fps=200 -o r.mcap";
    coshade(folder.path(), record).success();
    let before = std::fs::read(folder.path().join("r.mcap")).unwrap();
    let refused = coshade(folder.path(), record).failure(2);
    assert!(refused.stderr.contains("r.mcap"), "{}", refused.stderr);
    assert!(before == std::fs::read(folder.path().join("r.mcap")).unwrap(), "the refused run changed the file");
    coshade(folder.path(), &format!("{record} --overwrite")).success();
}

#[test]
fn a_cut_recording_is_named_as_such_and_still_plays() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("camera"), 100, [64, 48]);
    coshade(folder.path(), "record --source camera=images:camera/*.png?fps=100 -o r.mcap").success();
    let whole = std::fs::read(folder.path().join("r.mcap")).unwrap();
    std::fs::write(folder.path().join("cut.mcap"), &whole[..whole.len() * 3 / 4]).unwrap();

    let info = coshade(folder.path(), "info cut.mcap --json").any().json();
    assert!(!info["problems"].as_array().unwrap().is_empty());
    let played = coshade(folder.path(), "replay cut.mcap --rate max --json").any().json();
    let frames = played["streams"][0]["frames"].as_u64().unwrap();
    assert!((20..100).contains(&frames), "{frames} frames of 100");
}

#[test]
fn mistakes_are_answered_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("camera"), 1, [16, 16]);
    std::fs::write(folder.path().join("notes.txt"), "hello").unwrap();
    std::fs::write(folder.path().join("bad.toml"), "version = 1\n[camera]\nsorce = \"v4l:/dev/video0\"\n").unwrap();
    let cases = [
        ("info nothing", "nothing"),
        ("info notes.txt", ".mcap"),
        ("record --source camera=image:camera -o x.mcap", "images:"),
        ("record --source camera=images:none/*.png -o x.mcap", "none/*.png"),
        ("record --source camera=images:camera --calibration eye=c.toml -o x.mcap", "eye"),
        ("record --source camera=images:camera --source camera=images:camera -o x.mcap", "two sources"),
        ("record bad.toml -o x.mcap", "did you mean `source`"),
        ("replay nothing.mcap", "nothing.mcap"),
        ("compare camera/0000.png nothing.png", "nothing.png"),
        ("replay x.mcap --rate fast", "max"),
    ];
    for (args, expected) in cases {
        let Run { stderr, .. } = coshade(folder.path(), args).failure(2);
        assert!(stderr.contains(expected), "coshade {args}: {stderr}");
        assert!(!folder.path().join("x.mcap").exists(), "coshade {args} left a file behind");
    }
    let listed = coshade(folder.path(), "info bad.toml").failure(1);
    assert!(listed.stdout.contains("bad.toml:3:1"), "{}", listed.stdout);
}

#[test]
fn doctor_says_a_cure_for_every_problem() {
    let report = coshade(std::path::Path::new("."), "doctor --json").any().json();
    let checks = report["checks"].as_array().unwrap();
    assert!(checks.len() >= 4);
    for check in checks.iter().filter(|check| check["status"] != "ok") {
        assert!(check["cure"].as_str().is_some_and(|cure| !cure.is_empty()), "{check}");
    }
}
