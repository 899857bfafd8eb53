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

    let recorded = run(
        "record --source camera=images:camera/*.png?fps=100 --source fisheye=images:fisheye/*.png?fps=50 \
                        -o r.mcap --json",
    )
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
        let exported =
            image::open(folder.path().join(format!("out/camera/{index:06}.png"))).unwrap().into_rgb8();
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
    let session =
        "version = 1\n[camera]\nsource = \"images:camera/*.png?fps=100\"\ncalibration = \"camera.toml\"\n";
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
    assert!(
        before == std::fs::read(folder.path().join("r.mcap")).unwrap(),
        "the refused run changed the file"
    );
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
    std::fs::write(folder.path().join("notes.yaml"), "hello").unwrap();
    std::fs::write(folder.path().join("bad.toml"), "version = 1\n[camera]\nsorce = \"v4l:/dev/video0\"\n")
        .unwrap();
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
        ("record -o x.mcap", "--source NAME=URI"),
        ("record --source a=images:camera --frames 0 -o x.mcap", "--frames"),
        ("record --source a=images:camera --duration 0 -o x.mcap", "no time"),
        ("record --source a=images:camera --duration nan -o x.mcap", "number of seconds"),
        ("record --source a=images:camera --duration -1 -o x.mcap", "number of seconds"),
        ("record --source a/b=images:camera -o x.mcap", "a/b"),
        ("record --source ..=images:camera -o x.mcap", "dots alone"),
        ("record --source a=images:camera -o camera", "is a folder"),
        ("record --source a=images:camera -o none/x.mcap", "folder exists"),
        ("info camera --depth-unit-m nan", "0.001"),
        ("info notes.yaml", "OpenCV"),
    ];
    for (args, expected) in cases {
        let Run { stderr, .. } = coshade(folder.path(), args).failure(2);
        assert!(stderr.contains(expected), "coshade {args}: {stderr}");
        assert!(!folder.path().join("x.mcap").exists(), "coshade {args} left a file behind");
    }
    let missing = coshade(folder.path(), "replay nothing.mcap").failure(2).stderr;
    assert_eq!(missing.lines().count(), 1, "one line, without colours where nobody sees them: {missing}");
    assert_eq!(missing.matches("os error").count(), 1, "a cause is said once: {missing}");
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

#[test]
fn a_recording_is_not_overwritten_by_what_reads_it() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("camera"), 3, [16, 16]);
    coshade(folder.path(), "record --source camera=images:camera/*.png?fps=200 -o r.mcap").success();
    let before = std::fs::read(folder.path().join("r.mcap")).unwrap();
    for args in [
        "record --source a=replay:./r.mcap#camera?rate=max -o r.mcap --overwrite",
        "record --source a/b=images:camera -o r.mcap --overwrite",
    ] {
        coshade(folder.path(), args).failure(2);
        assert!(
            before == std::fs::read(folder.path().join("r.mcap")).unwrap(),
            "coshade {args} changed the file"
        );
    }
    let copied = "record --source a=replay:r.mcap#camera?rate=max -o copy.mcap --json";
    assert_eq!(coshade(folder.path(), copied).success().json()["streams"][0]["written"], 3);
}

#[test]
fn streams_keep_their_order() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("frames"), 2, [16, 16]);
    // The later sources deliver their first frame first: the earlier ones are large.
    gradient_frames(&folder.path().join("large"), 2, [1024, 768]);
    let record = "record --source z=images:large/*.png?pace=fast --source y=images:large/*.png?pace=fast \
                  --source x=images:frames/*.png?pace=fast -o r.mcap --json";
    coshade(folder.path(), record).success();
    let info = coshade(folder.path(), "info r.mcap --json").success().json();
    let names: Vec<_> =
        info["content"]["streams"].as_array().unwrap().iter().map(|s| s["name"].clone()).collect();
    assert_eq!(names, ["z", "y", "x"]);
}

#[test]
fn a_start_behind_the_end_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("camera"), 3, [16, 16]);
    coshade(folder.path(), "record --source camera=images:camera/*.png?fps=100 -o r#1.mcap").success();
    let refused = coshade(folder.path(), "replay r#1.mcap --start 100").failure(2);
    assert!(refused.stderr.contains("--start 100"), "{}", refused.stderr);
    assert!(coshade(folder.path(), "replay r#1.mcap --start -1").failure(2).stderr.contains("0 or more"));
    coshade(folder.path(), "replay r#1.mcap --start 0.01 --rate max").success();
    coshade(folder.path(), "replay r#1.mcap#camera --rate max").success();
}

#[test]
fn what_16_bit_grey_means_is_said() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("frames")).unwrap();
    let ramp = image::ImageBuffer::from_fn(8, 4, |x, _| image::Luma([250 * x as u16]));
    ramp.save(folder.path().join("frames/ramp.png")).unwrap();

    let grey = coshade(folder.path(), "info frames/ramp.png --json").success().json();
    assert_eq!(grey["content"]["series"][0]["codes"], serde_json::json!([0, 1750]));
    assert_eq!(grey["content"]["series"][0]["depth"], Value::Null);
    assert!(grey["problems"][0]["message"].as_str().unwrap().contains("--depth-unit-m"), "{grey}");

    for path in ["frames/ramp.png", "frames"] {
        let depth =
            coshade(folder.path(), &format!("info {path} --depth-unit-m 0.002 --json")).success().json();
        let depth = &depth["content"]["series"][0]["depth"];
        let close = |key: &str, expected: f64| (depth[key].as_f64().unwrap() - expected).abs() < 1e-9;
        // One of eight columns is 0, which is no depth; the median of the others is the fourth of seven.
        assert!(close("min_m", 0.5) && close("median_m", 2.0) && close("max_m", 3.5), "{depth}");
        assert!(close("valid_share", 0.875), "{depth}");
    }
}

#[test]
fn folders_say_what_they_hold() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    for name in ["meshes", "tags", "broken"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    write("meshes/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("meshes/readme.txt", "");
    let refused = coshade(folder.path(), "info meshes").failure(2).stderr;
    assert!(refused.contains("look at one of a.obj") && !refused.contains("readme"), "{refused}");

    write("broken/a.png", "nothing");
    let broken = coshade(folder.path(), "info broken").failure(1).stdout;
    assert!(broken.contains("error: ") && broken.contains("a.png"), "{broken}");

    // A list of visible tags is called as lists of poses are.
    gradient_frames(&folder.path().join("tags"), 2, [16, 16]);
    write("tags/groundtruth.txt", "0000.png 13 19\n0001.png 11 13 19\n");
    let count = || coshade(folder.path(), "info tags --json").success().json()["content"]["poses"].clone();
    assert_eq!(count(), 0);
    write("tags/groundtruth.txt", "# time tx ty tz qx qy qz qw\n1.5 0 0 0 0 0 0 1\n");
    assert_eq!(count(), 1);
}

#[cfg(unix)]
#[test]
fn pipes_are_refused_instead_of_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let made = std::process::Command::new("mkfifo").arg(folder.path().join("pipe.mcap")).status();
    if !made.is_ok_and(|status| status.success()) {
        println!("skipped: pipes_are_refused_instead_of_waited_for: no mkfifo");
        return;
    }
    for args in ["replay pipe.mcap", "info pipe.mcap", "record --source a=replay:pipe.mcap -o x.mcap"] {
        let refused = coshade(folder.path(), args).failure(2).stderr;
        assert!(refused.contains("pipe.mcap"), "coshade {args}: {refused}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named() {
    let folder = tempfile::tempdir().unwrap();
    gradient_frames(&folder.path().join("camera"), 2, [16, 16]);
    for args in [
        "record --source a=images:camera?pace=fast -o /dev/full --overwrite",
        "compare camera/0000.png camera/0001.png --diff /dev/full",
    ] {
        let refused = coshade(folder.path(), args).failure(2).stderr;
        assert!(refused.contains("/dev/full"), "coshade {args}: {refused}");
    }
    assert!(std::path::Path::new("/dev/full").exists(), "a device is no leftover to remove");
}

#[test]
fn a_described_world_becomes_a_recording_and_a_camera() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["desk.toml", "board.toml"] {
        std::fs::copy(workspace("sim/tests/data").join(name), folder.path().join(name)).unwrap();
    }
    let described = coshade(folder.path(), "info desk.toml --json").success().json();
    assert_eq!(described["kind"], "world");
    assert_eq!(coshade(folder.path(), "info board.toml --json").success().json()["kind"], "board");

    let simulated = coshade(folder.path(), "simulate desk.toml -o w.mcap --no-cache --json").success().json();
    let recorded = coshade(folder.path(), "info w.mcap --json").success().json();
    for (told, found) in simulated["streams"]
        .as_array()
        .unwrap()
        .iter()
        .zip(recorded["content"]["streams"].as_array().unwrap())
    {
        assert_eq!((&told["name"], &told["written"]), (&found["name"], &found["frames"]));
        assert_eq!(found["calibration"], true);
    }
    assert!(folder.path().join("w.truth.json").exists());

    let live = "record --source camera=sim:desk.toml#camera?pace=fast&cache=cache -o live.mcap --json";
    let live = coshade(folder.path(), live).success().json();
    assert_eq!(live["streams"][0]["written"], simulated["streams"][0]["written"]);
}

#[test]
fn the_truth_of_a_frame_of_a_world_is_traced_and_shown_on_a_sheet() {
    let folder = tempfile::tempdir().unwrap();
    let world = workspace("sim/tests/data/desk.toml");
    let world = world.to_str().unwrap();
    let run = |args: &str| coshade(folder.path(), args);

    let traced =
        run(&format!("reference {world}#camera --frame 3 --samples 2 -o truth.exr --json")).success();
    assert_eq!(traced.json()["samples_min"], 2);
    let pictured = run("info truth.exr --json").success().json().to_string();
    assert!(pictured.contains("difference") && pictured.contains("coverage"), "{pictured}");
    run(&format!("reference {world}#camera --samples 2 -o first.exr")).success();
    let moved = run("compare truth.exr#real first.exr#real --json").success().json();
    assert_eq!(moved["identical"], false, "the rig moves between frames 0 and 3");

    run(&format!("simulate {world} --no-cache -o r.mcap")).success();
    run("sheet truth.exr#mixed truth.exr#difference truth.exr#depth_z_m r.mcap --columns 3 --tile-px 100 -o s.png")
        .success();
    let sheet = image::open(folder.path().join("s.png")).unwrap();
    // Three tiles of 100 px in a row, 12 px between them; a row of pictures and one for each of three streams.
    assert_eq!(sheet.width(), 3 * 100 + 4 * 12);
    assert_eq!(sheet.height(), (60 + 60 + 48 + 64) + 4 * (22 + 12) + 12);

    for (args, expected) in [
        (format!("reference {world} -o x.exr"), "#camera"),
        (format!("reference {world}#nose -o x.exr"), "no sensor `nose`; there are camera, depth, fisheye"),
        (format!("reference {world}#camera --frame 5 -o x.exr"), "camera exposes 5 frames"),
        ("sheet truth.exr -o s.png".to_owned(), "name a layer"),
        ("sheet r.mcap#nose -o s.png".to_owned(), "nose"),
        ("sheet truth.exr#mixed -o s.jpg".to_owned(), ".png"),
    ] {
        let refused = run(&args).failure(2);
        assert!(refused.stderr.contains(expected), "{args}: {}", refused.stderr);
    }
}
