//! `coshade track`, as a user runs it, on pictures whose poses are known by construction.

#![expect(clippy::unwrap_used, clippy::panic, reason = "helpers of tests: a panic is a failed test")]

mod support;

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use coshade_capture::clock;
use coshade_tracker::{Family, tag_bitmap};
use image::{Luma, Rgb, RgbImage};
use serde_json::Value;
use support::coshade;

const SIZE_PX: [u32; 2] = [640, 480];
const FOCAL_PX: f64 = 600.0;
const CENTER_PX: [f64; 2] = [319.5, 239.5];
/// Of a tag's cell, so that its edges are those of pixels.
const CELL_PX: u32 = 9;
/// tag36h11 has 8 cells between its corners.
const TAG_PX: f64 = 8.0 * CELL_PX as f64;
const TAG_M: f64 = 0.04;
/// From the middle of one tag of the board to the next.
const PITCH_PX: u32 = 120;
/// The print faces the camera at this distance.
const DISTANCE_M: f64 = FOCAL_PX * TAG_M / TAG_PX;
const METRES_PER_PX: f64 = TAG_M / TAG_PX;
/// How far the board moves to the right from frame to frame.
const STEP_PX: u32 = 3;
const FRAMES: u32 = 8;

/// Every camera blurs: without, an edge between two pixels could be anywhere in between.
const BLUR_PX: f32 = 0.6;
/// How well corners can be found at least.
const CORNER_PX: f64 = 0.1;

/// Middle of the board in a frame, in camera coordinates.
fn board_center_px(frame: u32) -> [f64; 2] {
    [279.5 + f64::from(frame * STEP_PX), 219.5]
}

/// The middles of tags 0 to 3, row by row from the upper left.
fn tag_center_px(frame: u32, tag: u32) -> [f64; 2] {
    let [x, y] = board_center_px(frame);
    let offset = |index: u32| (f64::from(index) - 0.5) * f64::from(PITCH_PX);
    [x + offset(tag % 2), y + offset(tag / 2)]
}

fn paste_tag(picture: &mut image::GrayImage, tag: u32, [x, y]: [f64; 2]) {
    let bitmap = tag_bitmap(Family::Tag36h11, tag).unwrap();
    let half = f64::from(bitmap.cells * CELL_PX) / 2.0;
    // The edge of a pixel is half a pixel before its centre.
    let [left, top] = [x - half + 0.5, y - half + 0.5].map(|edge| edge as u32);
    for row in 0..bitmap.cells * CELL_PX {
        for column in 0..bitmap.cells * CELL_PX {
            let code = if bitmap.is_white(column / CELL_PX, row / CELL_PX) { 225 } else { 30 };
            picture.put_pixel(left + column, top + row, Luma([code]));
        }
    }
}

/// A board of four tags that moves to the right, seen from the front, and a session about it.
fn desk(folder: &Path) {
    std::fs::create_dir_all(folder.join("photos")).unwrap();
    for frame in 0..FRAMES {
        let mut picture = image::GrayImage::from_pixel(SIZE_PX[0], SIZE_PX[1], Luma([225]));
        (0..4).for_each(|tag| paste_tag(&mut picture, tag, tag_center_px(frame, tag)));
        let picture = image::imageops::blur(&picture, BLUR_PX);
        picture.save(folder.join(format!("photos/{frame:04}.png"))).unwrap();
    }
    let offset_m = f64::from(PITCH_PX) / 2.0 * METRES_PER_PX;
    let mut board = "version = 1\nfamily = \"tag36h11\"\n".to_owned();
    for (tag, [right, up]) in [[-1.0, 1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]].iter().enumerate() {
        let position = [right * offset_m, up * offset_m];
        board += &format!("[[tag]]\nid = {tag}\nsize_m = {TAG_M}\nposition_m = {position:?}\n");
    }
    write(folder, "board.toml", &board);
    write(folder, "camera.toml", &calibration(SIZE_PX, 1.0));
    write(folder, "session.toml", &session("photos", ""));
}

fn write(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).unwrap();
}

fn calibration([width, height]: [u32; 2], scale: f64) -> String {
    let [cx, cy] = CENTER_PX.map(|center| scale * (center + 0.5) - 0.5);
    let f = FOCAL_PX * scale;
    format!(
        "version = 1\nsize_px = [{width}, {height}]\n[lens]\nmodel = \"pinhole\"\nfx = {f}\nfy = {f}\ncx = {cx}\ncy = {cy}\n"
    )
}

fn session(photos: &str, more: &str) -> String {
    format!(
        "version = 1\n[camera]\nsource = \"images:{photos}\"\ncalibration = \"camera.toml\"\n{more}\n\
         [tracking]\nanchor = {{ board = \"board.toml\", up = \"z\" }}\n"
    )
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let list = value.as_array().unwrap_or_else(|| panic!("{value} is no list"));
    std::array::from_fn(|index| list[index].as_f64().unwrap())
}

fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Where the board's middle is, from the camera.
fn board_position_m(frame: u32) -> [f64; 3] {
    let [x, y] = board_center_px(frame);
    [(x - CENTER_PX[0]) * METRES_PER_PX, (y - CENTER_PX[1]) * METRES_PER_PX, DISTANCE_M]
}

/// The board of `row` must be where frame `frame` was drawn.
fn assert_is_truth(row: &Value, frame: u32) {
    let body = &row["bodies"][0];
    assert_eq!(body["name"], "board.toml", "{row}");
    let found: [f64; 3] = numbers(&body["measured_camera_from_body"]["position_m"]);
    let [x, y, z] = board_position_m(frame);
    // A shift of all corners moves it sideways; the distance is that by which the board's half extent changes, and the
    // middle moves along with it towards the middle of the image.
    let extent_px = f64::from(PITCH_PX) / 2.0 + TAG_PX / 2.0;
    let along_m = DISTANCE_M * CORNER_PX / extent_px;
    let across_m = CORNER_PX * METRES_PER_PX + along_m * (x.hypot(y) / z);
    let across = distance([found[0], found[1]], [x, y]);
    assert!(across < across_m && (found[2] - z).abs() < along_m, "frame {frame}: {found:?} for {x} {y} {z}");
    assert_eq!(body["tags_used"].as_array().unwrap().len(), 4, "{body}");
    for tag in row["tags"].as_array().unwrap() {
        let [x, y] = tag_center_px(frame, tag["id"].as_u64().unwrap() as u32);
        let half = TAG_PX / 2.0;
        let truth = [[x - half, y + half], [x + half, y + half], [x + half, y - half], [x - half, y - half]];
        for (corner, truth) in tag["corners_px"].as_array().unwrap().iter().zip(truth) {
            assert!(distance(numbers(corner), truth) < CORNER_PX, "frame {frame}: {corner} for {truth:?}");
        }
    }
}

#[test]
fn a_board_is_found_where_it_is_in_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    let found = coshade(folder.path(), "track session.toml --json --no-filter").success().json();
    let frames = found["frames"].as_array().unwrap();
    assert_eq!(frames.len() as u32, FRAMES);
    for (index, row) in (0..).zip(frames) {
        assert_eq!((&row["frame"], row["tags"].as_array().unwrap().len()), (&index.into(), 4));
        assert_is_truth(row, index);
        assert_eq!(row["bodies"][0]["camera_from_body"], row["bodies"][0]["measured_camera_from_body"]);
        // The print lies flat and is looked at from above: the camera is as far up as the board is away.
        let camera: [f64; 3] = numbers(&row["world_from_camera"]["position_m"]);
        let back: [f64; 3] = numbers(&row["bodies"][0]["camera_from_body"]["position_m"]);
        assert!((distance(camera, [0.0; 3]) - distance(back, [0.0; 3])).abs() < 1e-9);
        assert!(camera[2] > 0.99 * DISTANCE_M, "{camera:?}");
    }
    let pipeline = &found["pipeline"];
    for (key, count) in [("frames_in", FRAMES), ("tracked", FRAMES), ("overwritten", 0), ("damaged", 0)] {
        assert_eq!(pipeline[key], count, "{key}");
    }
    let body = &found["bodies"][0];
    assert_eq!((&body["frames"], &body["jumps"]), (&FRAMES.into(), &0.into()));
    assert_eq!(found["tags"].as_array().unwrap().len(), 4);

    // The same without a session file, with the filter, and looking only where tags were.
    let other = "track images:photos --calibration camera.toml --board board.toml --json-lines --full-frame --no-filter";
    let lines = coshade(folder.path(), other).success().stdout;
    let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len() as u32, FRAMES + 1, "a line a frame, and the rest");
    (0..FRAMES).for_each(|index| assert_is_truth(&lines[index as usize], index));
    assert_eq!(lines[FRAMES as usize]["pipeline"]["tracked"], FRAMES);
}

#[test]
fn the_table_says_the_same_as_json() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    let table = coshade(folder.path(), "track session.toml --frames 3").success().stdout;
    let rows: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split_whitespace().collect())
        .filter(|words: &Vec<&str>| words.get(2) == Some(&"board.toml"))
        .collect();
    assert_eq!(rows.len(), 3, "{table}");
    let found = coshade(folder.path(), "track session.toml --frames 3 --json").success().json();
    for (words, row) in rows.iter().zip(found["frames"].as_array().unwrap()) {
        assert_eq!(words[0], row["frame"].to_string());
        let position_m: [f64; 3] = numbers(&row["bodies"][0]["camera_from_body"]["position_m"]);
        let printed = [3, 4, 5].map(|column| words[column].parse::<f64>().unwrap());
        // Two digits are printed.
        assert!(distance(printed, position_m.map(|m| m * 1e3)) < 0.01, "{words:?} {position_m:?}");
    }
    assert!(table.contains("board.toml: in 3 frames") && table.contains("latency"), "{table}");
}

#[test]
fn axes_are_drawn_where_the_board_is() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    coshade(folder.path(), "track session.toml -o all").success();
    coshade(folder.path(), "track session.toml --frames 6 -o one.png").success();
    let one = image::open(folder.path().join("one.png")).unwrap().into_rgb8();
    assert!(one == image::open(folder.path().join("all/000005.png")).unwrap().into_rgb8());
    assert_eq!(std::fs::read_dir(folder.path().join("all")).unwrap().count() as u32, FRAMES);
    let drawn = |x: f64, y: f64| *one.get_pixel(x.round() as u32, y.round() as u32);
    let [x, y] = board_center_px(5);
    // Axes are as long as a tag: x to the right, y up, z towards the camera, in red, green and blue; between the tags the
    // paper is grey otherwise.
    let is = |Rgb([r, g, b]): Rgb<u8>, axis: usize| {
        let [own, others] = [
            [r, g, b][axis],
            [r, g, b].into_iter().enumerate().filter(|(i, _)| *i != axis).map(|(_, c)| c).max().unwrap(),
        ];
        own > others.saturating_add(60)
    };
    for share in [0.3, 0.6, 0.95] {
        assert!(is(drawn(x + share * TAG_PX, y), 0), "x at {share}: {:?}", drawn(x + share * TAG_PX, y));
        assert!(is(drawn(x, y - share * TAG_PX), 1), "y at {share}: {:?}", drawn(x, y - share * TAG_PX));
    }
    for (dx, dy) in [(TAG_PX + 4.0, 0.0), (-8.0, 0.0), (0.0, -TAG_PX - 4.0)] {
        assert_eq!(drawn(x + dx, y + dy), Rgb([225; 3]), "nothing is drawn at {dx} {dy}");
    }
}

#[test]
fn one_frame_is_tracked_by_itself() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    let found = coshade(folder.path(), "track session.toml --frame 5 --json").success().json();
    assert_eq!(found["frames"].as_array().unwrap().len(), 1);
    assert_is_truth(&found["frames"][0], 5);
}

#[test]
fn a_calibration_of_another_size_is_scaled_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    write(folder.path(), "camera.toml", &calibration([320, 240], 0.5));
    let scaled = coshade(folder.path(), "track session.toml --json --no-filter --frames 2").success();
    assert!(scaled.stderr.contains("binning"), "{}", scaled.stderr);
    assert_is_truth(&scaled.json()["frames"][1], 1);
    write(folder.path(), "camera.toml", &calibration([640, 360], 1.0));
    let refused = coshade(folder.path(), "track session.toml").failure(2).stderr;
    for text in ["camera.toml", "640", "360", "480"] {
        assert!(refused.contains(text), "{text}: {refused}");
    }
}

#[test]
fn a_damaged_frame_is_left_out_and_told() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    let whole = std::fs::read(folder.path().join("photos/0003.png")).unwrap();
    std::fs::write(folder.path().join("photos/0003.png"), &whole[..whole.len() / 2]).unwrap();
    let run = coshade(folder.path(), "track session.toml --json --no-filter").failure(1);
    let found = run.json();
    assert_eq!(found["pipeline"]["damaged"], 1);
    assert!(run.stderr.contains("0003.png"), "{}", run.stderr);
    let frames = found["frames"].as_array().unwrap();
    let numbers: Vec<_> = frames.iter().map(|row| row["frame"].as_u64().unwrap() as u32).collect();
    assert_eq!(numbers, [0, 1, 2, 4, 5, 6, 7]);
    frames.iter().zip(numbers).for_each(|(row, index)| assert_is_truth(row, index));
}

#[test]
fn a_tag_that_is_not_as_described_is_told() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    let board = std::fs::read_to_string(folder.path().join("board.toml")).unwrap();
    let size = |scale: f64| format!("size_m = {}", scale * TAG_M);
    // One of four: the others outvote it.
    write(folder.path(), "board.toml", &board.replacen(&size(1.0), &size(2.0), 1));
    let found = coshade(folder.path(), "track session.toml --json").success().json();
    for row in found["frames"].as_array().unwrap() {
        let rejected = &row["bodies"][0]["tags_rejected"];
        assert_eq!(
            (&rejected[0]["tag"], rejected.as_array().unwrap().len()),
            (&"tag36h11 0".into(), 1),
            "{row}"
        );
        assert!(rejected[0]["reason"].as_str().unwrap().contains("px from where"), "{rejected}");
    }
    assert_eq!(found["bodies"][0]["frames_with_rejected_tags"], FRAMES);
    // All of them, not so far apart as they are large: nobody can tell which is right, only that nothing fits.
    write(folder.path(), "board.toml", &board.replace(&size(1.0), &size(2.0)));
    let run = coshade(folder.path(), "track session.toml --json --frames 2").success();
    let warning = run.json()["warnings"][0]["message"].as_str().unwrap().to_owned();
    assert!(warning.contains("board.toml: tags do not fit the body"), "{warning}");
    assert!(run.stderr.contains(&warning), "{}", run.stderr);
    assert!(coshade(folder.path(), "track session.toml --frames 2").success().stdout.contains(&warning));
}

#[test]
fn pictures_without_tags_are_no_error() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    for (name, code) in [("0.png", 0), ("1.png", 255)] {
        let blank = RgbImage::from_pixel(SIZE_PX[0], SIZE_PX[1], Rgb([code; 3]));
        blank.save(folder.path().join("empty").join(name)).unwrap();
    }
    write(folder.path(), "session.toml", &session("empty", ""));
    let found = coshade(folder.path(), "track session.toml --json").success().json();
    for row in found["frames"].as_array().unwrap() {
        assert_eq!((&row["bodies"], &row["tags"]), (&Value::Array(vec![]), &Value::Array(vec![])));
        assert!(row["world_from_camera"].is_null());
    }
    assert_eq!(found["bodies"][0]["frames"], 0);
}

#[test]
fn mistakes_are_answered_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    let fixed = "pose = { in = \"world\", position_m = [0, 0, 1] }";
    write(folder.path(), "fixed.toml", &session("photos", fixed));
    write(folder.path(), "plane.toml", &session("photos", "").replace("up = \"z\"", "up = \"plane\""));
    let nothing = session("photos", "").replace("[tracking]", "").replace("anchor", "#");
    write(folder.path(), "nothing.toml", &nothing);
    let cases = [
        ("track none.toml", "none.toml"),
        ("track photos", "images:photos"),
        ("track board.toml", "board of tags"),
        ("track images:none/*.png --calibration camera.toml", "none/*.png"),
        ("track images:photos", "--calibration"),
        ("track session.toml --board board.toml", "--board"),
        ("track fixed.toml", "stands still"),
        ("track plane.toml", "depth image"),
        ("track nothing.toml", "[tracking] anchor"),
        ("track session.toml --frame 77", "numbered 0 to"),
        ("track session.toml --frames 0", "--frames"),
        ("track session.toml --decimate 0.5", "from 1 to 16"),
        ("track session.toml --threads 0", "--threads"),
        ("track images:photos --calibration camera.toml --tag tag36h11:600:0.05", "0 to 586"),
        ("track images:photos --calibration camera.toml --tag tag36h11:6:0", "metres"),
        ("track images:photos --calibration camera.toml --tag tag36h10:6:0.1", "did you mean `tag36h11`"),
        ("track images:photos --calibration camera.toml --board camera.toml", "camera.toml"),
        ("track images:photos --calibration board.toml --board board.toml", "board.toml"),
        (
            "track images:photos --calibration camera.toml --board board.toml --tag tag36h11:2:0.05",
            "one size",
        ),
    ];
    for (args, answer) in cases {
        let run = coshade(folder.path(), args).failure(2);
        assert!(run.stderr.contains(answer), "coshade {args} does not say {answer:?}:\n{}", run.stderr);
        assert!(!run.stderr.contains("panicked"), "coshade {args}\n{}", run.stderr);
    }
}

#[test]
#[cfg(unix)]
fn ctrl_c_ends_it_with_what_is_done() {
    let folder = tempfile::tempdir().unwrap();
    desk(folder.path());
    write(folder.path(), "session.toml", &session("photos?loop=true&fps=50", ""));
    let mut command = Command::new(support::binary());
    command.args(["track", "session.toml", "--live", "--json"]).current_dir(folder.path());
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(2));
    let pressed = clock::now();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let took = clock::now().saturating_since(pressed);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(found["pipeline"]["tracked"].as_u64().unwrap() > 0);
    assert!(took < Duration::from_secs(1), "it took {took:?} to end");
}
