//! `coshade board`, as a user runs it.

mod support;

use serde_json::json;
use support::{coshade, workspace};

const DESK: &str = "board --family tag36h11 --grid 4x3 --size-mm 41 --gap-mm 11 --landscape";

#[test]
fn the_board_of_the_desk_can_be_printed() {
    let folder = tempfile::tempdir().unwrap();
    let summary = coshade(folder.path(), &format!("{DESK} -o desk.pdf -o desk.svg --json")).success().json();
    assert_eq!(summary["size_mm"], 41.0);
    assert_eq!(summary["pitch_mm"], 52.0);
    assert_eq!(summary["paper_mm"], json!([297.0, 210.0]));
    assert_eq!(summary["toml"], "desk.toml");
    let notes = summary["notes"].as_array().unwrap();
    assert_eq!(notes.len(), 1, "there is no room for numbers: {notes:?}");

    // The board file is that of the described desk.
    let printed = coshade(folder.path(), "info desk.toml --json").success().json();
    let described = coshade(&workspace("worlds"), "info board.toml --json").success().json();
    for key in ["tag", "family", "is_flat", "families", "extent_m"] {
        assert_eq!(printed["content"][key], described["content"][key], "{key}");
    }
    assert_eq!(printed["content"]["is_flat"], true);
    let pdf = std::fs::read(folder.path().join("desk.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF-1."));
}

#[test]
fn an_image_states_its_resolution_and_the_board_file_what_it_holds() {
    let folder = tempfile::tempdir().unwrap();
    let run =
        coshade(folder.path(), "board --ids 3,7-8 --size-mm 20 --dpi 300 --landscape -o ids.png --json");
    let summary = run.success().json();
    assert_eq!(summary["ids"], json!([3, 7, 8]));
    // 8 cells of 29.5 pixels become 30 each, of 1/11811 m.
    let size_mm = summary["size_mm"].as_f64().unwrap();
    assert!((size_mm - 8.0 * 30.0 / 11.811).abs() < 1e-9, "{size_mm}");
    let notes = summary["notes"].to_string();
    assert!(notes.contains("tags are 20.3200 mm instead of 20 mm"), "{notes}");
    let image = image::open(folder.path().join("ids.png")).unwrap().into_luma8();
    assert_eq!(image.dimensions(), (3508, 2480));
    // The corner of the first tag: white outside, black inside.
    let [x, y] = [0, 1].map(|axis| summary["first_corner_mm"][axis].as_f64().unwrap() * 11.811);
    let [x, y] = [x.round() as u32, y.round() as u32];
    assert_eq!([image[(x, y)].0, image[(x - 1, y)].0, image[(x, y - 1)].0], [[0], [255], [255]]);
    let board = coshade(folder.path(), "info ids.toml --json").success().json();
    let read_m = board["content"]["tag"][1]["size_m"].as_f64().unwrap();
    assert!((read_m * 1e3 - size_mm).abs() < 1e-6, "whole nanometres");
}

#[test]
fn a_single_tag_needs_a_number_and_a_size() {
    let folder = tempfile::tempdir().unwrap();
    let tag = coshade(folder.path(), "board --id 7 --size-mm 50 --paper fit -o tag.svg --toml seven.toml");
    let tag = tag.success();
    assert!(tag.stdout.starts_with("1 tag of tag36h11, 50.0000 mm, on 131 × "), "{}", tag.stdout);
    let svg = std::fs::read_to_string(folder.path().join("tag.svg")).unwrap();
    assert!(svg.contains("width=\"131mm\"") && svg.contains("aria-label=\"tag36h11 7\""));
    assert!(folder.path().join("seven.toml").exists());
}

#[test]
fn nothing_is_written_over_what_exists() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("a.toml"), "mine").unwrap();
    let refused = coshade(folder.path(), &format!("{DESK} -o a.pdf")).failure(2);
    assert!(refused.stderr.contains("a.toml: exists already"), "{}", refused.stderr);
    assert!(!path("a.pdf").exists(), "a part was written");
    assert_eq!(std::fs::read_to_string(path("a.toml")).unwrap(), "mine");
    coshade(folder.path(), &format!("{DESK} -o a.pdf --overwrite")).success();
    assert!(std::fs::read_to_string(path("a.toml")).unwrap().starts_with("version = 1"));
}

#[test]
fn mistakes_are_answered_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("folder.pdf")).unwrap();
    let cases = [
        ("board --size-mm 40 -o a.pdf", "--grid 4x3"),
        ("board --id 7 -o a.pdf", "--size-mm"),
        ("board --id 7 --size-mm 40", "--output"),
        ("board --id 7 --size-mm 40 -o a.tiff", ".pdf, .svg or .png"),
        ("board --id 7 --size-mm 40 -o a.pdf -o a.pdf", "written twice"),
        ("board --id 7 --size-mm 40 -o a.pdf --toml a.json", ".toml"),
        ("board --id 7 --size-mm 40 -o none/a.pdf", "no folder none"),
        ("board --id 7 --size-mm 40 -o folder.pdf", "is a folder"),
        ("board --id 600 --size-mm 40 -o a.pdf", "tag36h11 has no tag 600"),
        ("board --id 7 --ids 3 --size-mm 40 -o a.pdf", "cannot be used with"),
        ("board --id 7 --family tag36h10 --size-mm 40 -o a.pdf", "did you mean `tag36h11`"),
        ("board --id 7 --size-mm nan -o a.pdf", "NaN is out of range"),
        ("board --id 7 --size-mm -4 -o a.pdf", "--size-mm"),
        ("board --grid 4 --size-mm 40 -o a.pdf", "such as 4x3"),
        ("board --grid 0x3 --size-mm 40 -o a.pdf", "such as 4x3"),
        ("board --grid 30x30 --size-mm 4 -o a.pdf", "its last is 586"),
        ("board --grid 2x2 --first-id 4294967295 --size-mm 4 -o a.pdf", "its last is 586"),
        ("board --grid 2x2 --ids 1,2,3 --size-mm 40 -o a.pdf", "--ids names 3 tags, but --grid 2x2 holds 4"),
        ("board --ids 1,,3 --size-mm 40 -o a.pdf", "3,7,9 or 0-11"),
        ("board --ids 9-2 --size-mm 40 -o a.pdf", "from the lower number"),
        ("board --ids 0-4294967295 --size-mm 40 -o a.pdf", "at most 4096"),
        ("board --ids 2,2 --size-mm 40 -o a.pdf", "tag 2 is there twice"),
        ("board --grid 2x2 --size-mm 40 --gap-mm 9 -o a.pdf", "a gap of 10 mm at least"),
        (
            "board --grid 6x6 --size-mm 30 -o a.pdf",
            "17.5 mm too wide; it fits on a3, or with a size of 27.5 mm",
        ),
        ("board --id 7 --size-mm 40 --paper b4 -o a.pdf", "no paper is called `b4`"),
        ("board --id 7 --size-mm 40 --dpi 0 -o a.png", "25 to 10000"),
        ("board --id 7 --size-mm 4 --dpi 72 -o a.png", "raise the resolution"),
        ("board --id 7 --size-mm 40 --dpi 10000 -o a.png", "at most 2^28"),
    ];
    for (args, message) in cases {
        let refused = coshade(folder.path(), args).failure(2);
        assert!(refused.stderr.contains(message), "{args}: {message} in: {}", refused.stderr);
        assert!(!refused.stderr.contains("panicked"), "{}", refused.stderr);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "a refused run wrote a file");
}

#[test]
fn a_board_in_space_is_described() {
    let folder = workspace("tracker/tests/data");
    let info = coshade(&folder, "info cube.toml").success();
    assert!(info.stdout.contains("3 tags of tag25h9, tag36h11, in space"), "{}", info.stdout);
    assert!(info.stdout.contains("tag tag25h9 0: 0.03 m wide"), "{}", info.stdout);
    assert!(info.stdout.contains("0.21 px RMS"), "{}", info.stdout);
}
