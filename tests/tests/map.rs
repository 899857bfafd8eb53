//! `coshade map`, as a user runs it, on photographs of a room with tags on its walls.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

mod support;

use std::path::Path;

use serde_json::Value;
use support::coshade;

const LENS: &str = "version = 1\nsize_px = [816, 612]\n[lens]\nmodel = \"pinhole\"\nfx = 765.0\nfy = 764.18\ncx = 393.72\n\
                    cy = 304.66\n";

fn json(folder: &Path, args: &str) -> Value {
    let run = coshade(folder, args);
    assert_eq!(run.code, Some(0), "{}: {}", run.args, run.stderr);
    serde_json::from_str(&run.stdout).unwrap()
}

#[test]
fn a_room_is_mapped_and_then_tracked() {
    let Some(photographs) =
        coshade_testdata::find("a_room_is_mapped_and_then_tracked", "handheld-tags/swatbotics-mapping")
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lens.toml"), LENS).unwrap();
    let source = format!("images:{}/*.JPG", photographs.canonicalize().unwrap().display());
    let args = format!(
        "map {source} --calibration lens.toml --size-m 0.16 --refine-lens --refined-calibration refined.toml --origin 3 -o room.toml --json"
    );
    let map = json(folder.path(), &args);
    assert_eq!((map["images"].as_u64(), map["images_used"].as_u64()), (Some(37), Some(37)));
    assert_eq!(map["tags"].as_array().unwrap().len(), 20);
    assert_eq!(
        (&map["tags"][3]["position_m"], &map["origin"]),
        (&serde_json::json!([0.0, 0.0, 0.0]), &"tag36h11 3".into())
    );
    assert!(
        map["lens"]["params_std"]["k1"].as_f64().unwrap() > 0.0
            && map["unconnected"] == serde_json::json!([])
    );
    assert!(map["closure"]["tags"].as_array().unwrap().len() > 4);
    // What was written is a board in space, and every photograph shows where the camera was.
    let info = json(folder.path(), "info room.toml --json");
    assert_eq!(info["content"]["is_flat"], Value::Bool(false), "{info}");
    let args_of_track = format!(
        "track {source} --calibration refined.toml --board room.toml --no-filter --full-frame --json"
    );
    let tracked = json(folder.path(), &args_of_track);
    assert_eq!(tracked["bodies"][0]["frames"].as_u64(), Some(37));
    assert!(tracked["bodies"][0]["rms_px"]["median"].as_f64().unwrap() < 0.5);
    // Nothing is replaced unasked.
    let again = coshade(folder.path(), &args);
    assert!(again.code == Some(2) && again.stderr.contains("--overwrite"), "{}", again.stderr);
}

#[test]
fn what_cannot_be_mapped_is_said() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lens.toml"), LENS).unwrap();
    image::GrayImage::new(816, 612).save(folder.path().join("black.png")).unwrap();
    let black = "images:black.png --calibration lens.toml";
    let cases = [
        ("images:black.png --size-m 0.1 -o a.toml".to_owned(), "--calibration"),
        (format!("{black} -o a.toml"), "--size-m"),
        (format!("{black} --size-m 0.1 -o a.toml"), "0 of them with tags"),
        (format!("{black} --size-m 0.1 -o a.png"), ".toml"),
        (format!("{black} --size-m 0.1 -o a.toml --origin 9999"), "0 to 586"),
        (format!("{black} --size-m=-1 -o a.toml"), "--size-m"),
        ("images:absent/*.png --calibration lens.toml --size-m 0.1 -o a.toml".to_owned(), "absent"),
        ("lens.toml --size-m 0.1 -o a.toml".to_owned(), "calibration"),
    ];
    for (args, text) in cases {
        let run = coshade(folder.path(), &format!("map {args}"));
        assert!(run.code == Some(2) && run.stderr.contains(text), "{args}: {}", run.stderr);
        assert!(!folder.path().join("a.toml").exists());
    }
}
