//! Damaged session files: an answer, soon, and a place for every problem.

use coshade_config::Error;
use coshade_scene::{Rig, Session};
use coshade_testdata::mutate::mutations;

const SEEDS: [&str; 2] = [include_str!("data/session/design.toml"), include_str!("data/session/full.toml")];

fn check_places(error: &Error, text: &str) {
    let lines = text.split('\n').count();
    for problem in error.problems() {
        assert!((1..=lines).contains(&problem.line) && problem.column >= 1, "{problem}");
        assert!(!problem.message.is_empty());
    }
    assert!(!error.problems().is_empty(), "{error}");
}

#[test]
fn damaged_sessions_are_refused_with_places_or_read() {
    let mut read = 0;
    for seed in SEEDS {
        for (_, bytes) in mutations(seed.as_bytes(), 400) {
            let text = String::from_utf8_lossy(&bytes);
            match Session::parse(&text, "/nonexistent/desk.toml") {
                Ok(session) => {
                    read += 1;
                    for problem in session.check() {
                        assert!(problem.line >= 1 && problem.column >= 1, "{problem}");
                    }
                    let spec = session.spec().clone();
                    if let Err(error) = Session::new(&spec, "desk.toml") {
                        panic!("{error}\n{text}");
                    }
                }
                Err(error) => check_places(&error, &text),
            }
        }
    }
    assert!((1..800).contains(&read), "{read} of 800 readable");
}

#[test]
fn damaged_rigs_are_refused_with_places_or_read() {
    let seed = "version = 1\n[sensor.camera]\n[sensor.fisheye]\nposition_m = [0, 0.1, 0]\nquaternion_xyzw = [0, 0, 0.6, 0.8]\ntime_offset_ns = -1200\nreadout_s = 0.01\n[provenance]\ntool = 'x'\nrms_px = 0.2\n";
    for (_, bytes) in mutations(seed.as_bytes(), 300) {
        let text = String::from_utf8_lossy(&bytes);
        match Rig::parse(&text, "rig.toml") {
            Ok(rig) => assert!(rig.sensors.values().all(|sensor| sensor.rotation().is_ok())),
            Err(error) => check_places(&error, &text),
        }
    }
}

#[test]
fn hostile_sessions_end_in_messages() {
    let head = "version = 1\n[camera]\nsource = \"replay:a\"\n";
    let deep = format!("{head}x = {}", "[".repeat(100_000));
    let many_things = format!("{head}{}", "[[thing]]\n".repeat(100_000));
    let long_name = format!("{head}[[thing]]\nname = \"{}\"\nworld = \"real\"\n", "x".repeat(1_000_000));
    let large = format!(
        "{head}[[light]]\nworld = \"real\"\nkind = \"spot\"\ncone_deg = [{}1]\n",
        "1, ".repeat(300_000)
    );
    let twice = format!("{head}version = 1\nversion = 1\n[camera]\n");
    let number = format!("{head}[render]\nvpls = {}\n", "9".repeat(10_000));
    for text in [deep, many_things, long_name, large, twice, number] {
        match Session::parse(&text, "desk.toml") {
            Ok(_) => panic!("read: {}", text.get(..200).unwrap_or_default()),
            Err(error) => {
                check_places(&error, &text);
                assert!(error.to_string().len() < 200_000);
            }
        }
    }
}
