//! Every kind of problem, with the place and the words that a user gets.

#![expect(clippy::panic, reason = "clippy knows only functions marked as tests as tests")]
#![allow(dead_code, reason = "most fields are only read, to see what is refused")]

use std::collections::BTreeMap;

use coshade_config::{Document, Problem, parse};
use schemars::JsonSchema;
use serde::Deserialize;

/// A file with one of everything.
#[derive(Debug, Deserialize, JsonSchema)]
struct Room {
    /// Of this format.
    #[schemars(range(min = 1, max = 1))]
    version: u32,
    #[serde(default)]
    thing: Vec<Thing>,
    camera: Option<Camera>,
    #[serde(default)]
    sensors: BTreeMap<String, Sensor>,
}

#[derive(Debug, Deserialize, JsonSchema)]
struct Camera {
    /// Where the images come from. More words.
    #[schemars(length(min = 1))]
    source: String,
    size_px: Option<[u32; 2]>,
    gain: Option<f32>,
    #[schemars(extend("exclusiveMinimum" = 0))]
    exposure_s: Option<f64>,
}

#[derive(Debug, Deserialize, JsonSchema)]
struct Sensor {
    readout_s: f64,
}

#[derive(Debug, Deserialize, JsonSchema)]
struct Thing {
    name: String,
    world: World,
    pose: Option<Pose>,
    #[serde(flatten)]
    form: Form,
    size: Option<Size>,
    point: Option<(f64, u8)>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum World {
    /// In the room.
    Real,
    /// Drawn.
    Virtual,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(tag = "in", rename_all = "lowercase")]
enum Pose {
    World { position_m: Option<[f64; 3]> },
    Marker { family: String, id: u32, size_m: f64 },
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Form {
    Mesh(String),
    Shape(Shape),
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Shape {
    Box([f64; 3]),
    Sphere(f64),
    Nothing,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Size {
    Uniform(f64),
    Each([f64; 3]),
    Named { width_m: f64, height_m: f64 },
}

fn problems(text: &str) -> Vec<Problem> {
    match parse::<Room>(text, "room.toml") {
        Ok(room) => panic!("no problem in {text}\n{room:?}"),
        Err(error) => error.problems().to_vec(),
    }
}

/// `line:column key: message = help` of every problem.
fn lines(text: &str) -> Vec<String> {
    let line = |p: &Problem| {
        let help = p.help.as_ref().map(|help| format!(" = {help}")).unwrap_or_default();
        format!("{}:{} {}: {}{help}", p.line, p.column, p.key, p.message)
    };
    problems(text).iter().map(line).collect()
}

fn thing(rest: &str) -> String {
    format!("version = 1\n[[thing]]\nname = \"a\"\nworld = \"real\"\n{rest}\n")
}

#[test]
fn a_file_without_problems_is_read() {
    let text = thing(
        "shape = { box = [1, 2.5, 3] }\npose = { in = \"marker\", family = \"f\", id = 3, size_m = 1 }",
    );
    let room: Room = parse(&text, "room.toml").unwrap();
    assert_eq!(room.version, 1);
    assert!(matches!(room.thing[0].form, Form::Shape(Shape::Box([1.0, 2.5, 3.0]))));
    assert!(matches!(room.thing[0].pose, Some(Pose::Marker { id: 3, .. })));
}

#[test]
fn unknown_keys_are_all_named_with_the_nearest_known_one() {
    let text = "version = 1
versoin = 2
[camera]
source = \"a\"
size = [1, 2]
[[thing]]
name = \"a\"
world = \"real\"
mesh = \"m\"
pose = { in = \"world\", positon_m = [0, 0, 0] }
[[thing]]
name = \"b\"
world = \"real\"
mesh = \"m\"
wrold = 1
[sensors.left]
readout_s = 0
redout_s = 1
";
    assert_eq!(
        lines(text),
        [
            "2:1 versoin: unknown key = did you mean `version`? That is given already",
            "5:1 camera.size: unknown key = did you mean `size_px`?",
            "10:24 thing[0].pose.positon_m: unknown key = did you mean `position_m`?",
            "15:1 thing[1].wrold: unknown key = did you mean `world`? That is given already",
            "18:1 sensors.left.redout_s: unknown key = did you mean `readout_s`? That is given already",
        ]
    );
}

#[test]
fn keys_of_another_variant_say_where_they_belong() {
    let text = thing("mesh = \"m\"\npose = { in = \"world\", size_m = 1 }");
    assert_eq!(lines(&text), ["6:24 thing[0].pose.size_m: unknown key = it belongs to in = \"marker\""]);
}

#[test]
fn missing_keys_are_told_with_type_and_meaning_where_their_table_starts() {
    assert_eq!(
        lines("version = 1\n[camera]\n[[thing]]\nname = \"a\"\n[sensors]\nleft = {}"),
        [
            "2:1 camera.source: missing key = it is a string: Where the images come from",
            "3:1 thing[0]: missing key: one of `mesh`, `shape`",
            "3:1 thing[0].world: missing key = it is one of `real`, `virtual`",
            "6:8 sensors.left.readout_s: missing key = it is a number",
        ]
    );
    assert_eq!(lines(""), ["1:1 version: missing key = it is an integer, 1 only: Of this format"]);
}

#[test]
fn a_slip_is_not_reported_as_missing_too() {
    assert_eq!(lines("vesion = 1"), ["1:1 vesion: unknown key = did you mean `version`?"]);
    let text = "version = 1\n[[thing]]\nname = \"a\"\nworld = \"real\"\nmsh = \"m\"";
    assert_eq!(lines(text), ["5:1 thing[0].msh: unknown key = did you mean `mesh`?"]);
}

#[test]
fn wrong_types_say_what_was_found_and_what_is_allowed() {
    let text = "version = 1.0
[camera]
source = 7
size_px = [640, 480, 3]
gain = \"high\"
[sensors]
left = 3
[[thing]]
name = true
world = [\"real\"]
mesh = \"m\"
pose = { in = \"world\", position_m = [0, \"0\", 0] }
point = [1.0, 300]
";
    assert_eq!(
        lines(text),
        [
            "1:11 version: expected an integer, 1 only, found a number (`1.0`) = write it without a decimal point: 1",
            "3:10 camera.source: expected a string, found an integer (`7`)",
            "4:11 camera.size_px: expected 2 elements, found 3",
            "5:8 camera.gain: expected a number, found a string (`\"high\"`)",
            "7:8 sensors.left: expected a table, found an integer (`3`)",
            "9:8 thing[0].name: expected a string, found `true`",
            "10:9 thing[0].world: expected one of `real`, `virtual`, found an array",
            "12:41 thing[0].pose.position_m[1]: expected a number, found a string (`\"0\"`)",
            "13:15 thing[0].point[1]: `300` is out of range = allowed: from 0 to 255",
        ]
    );
}

#[test]
fn numbers_are_finite_and_within_their_type() {
    let camera = |line: &str| lines(&format!("version = 1\n[camera]\nsource = \"a\"\n{line}"));
    assert_eq!(camera("gain = nan"), ["4:8 camera.gain: expected a finite number, found `nan`"]);
    assert_eq!(camera("gain = -inf"), ["4:8 camera.gain: expected a finite number, found `-inf`"]);
    assert_eq!(
        camera("exposure_s = 1e400"),
        ["4:14 camera.exposure_s: expected a finite number, found `1e400`"]
    );
    assert_eq!(
        camera("gain = 1e39"),
        ["4:8 camera.gain: `1e39` is out of range = allowed: within 32-bit floats (±3.4e38)"]
    );
    assert_eq!(
        camera("exposure_s = 0"),
        ["4:14 camera.exposure_s: `0` is out of range = allowed: greater than 0"]
    );
    assert_eq!(
        camera("size_px = [-1, 4294967296]"),
        [
            "4:12 camera.size_px[0]: `-1` is out of range = allowed: from 0 to 4294967295",
            "4:16 camera.size_px[1]: `4294967296` is out of range = allowed: from 0 to 4294967295",
        ]
    );
    assert_eq!(
        camera("exposure_s = 99999999999999999999999999999999999999999999"),
        [
            "4:14 camera.exposure_s: expected a 64-bit integer, found `9999999999999999999999999999999999999999…`"
        ]
    );
}

#[test]
fn unknown_values_are_told_with_the_nearest_known_one() {
    let text =
        "version = 1\n[[thing]]\nname = \"a\"\nworld = \"vitual\"\nmesh = \"m\"\npose = { in = \"wrold\" }";
    assert_eq!(
        lines(text),
        [
            "4:9 thing[0].world: unknown value `\"vitual\"` = did you mean `virtual`? Allowed: `real`, `virtual`",
            "6:15 thing[0].pose.in: unknown value `\"wrold\"` = did you mean `world`? Allowed: `world`, `marker`",
        ]
    );
}

#[test]
fn tags_must_be_there_and_be_strings() {
    assert_eq!(
        lines(&thing("mesh = \"m\"\npose = { size_m = 1, postion_m = [] }")),
        [
            "6:8 thing[0].pose.in: missing key = it is one of `world`, `marker`",
            "6:22 thing[0].pose.postion_m: unknown key = did you mean `position_m`?",
        ]
    );
    assert_eq!(
        lines(&thing("mesh = \"m\"\npose = { in = 3 }")),
        ["6:15 thing[0].pose.in: expected one of `world`, `marker`, found an integer (`3`)"]
    );
}

#[test]
fn of_keys_that_exclude_each_other_the_later_is_reported() {
    assert_eq!(
        lines(&thing("mesh = \"m\"\nshape = { box = [1, 1, 1], sphere = 1 }")),
        [
            "6:1 thing[0].shape: `shape` beside `mesh`, of which only one is allowed = give one of `mesh`, `shape`",
            "6:28 thing[0].shape.sphere: `sphere` beside `box`, of which only one is allowed = give one of `box`, `sphere`",
        ]
    );
}

#[test]
fn variants_without_content_are_strings() {
    assert!(parse::<Room>(&thing("shape = \"nothing\""), "a").is_ok());
    assert_eq!(
        lines(&thing("shape = \"nothin\"")),
        ["5:9 thing[0].shape: unknown value `\"nothin\"` = did you mean `nothing`? Allowed: `nothing`"]
    );
    assert_eq!(
        lines(&thing("shape = { bx = [1, 1, 1] }")),
        ["5:11 thing[0].shape.bx: unknown key = did you mean `box`?"]
    );
    assert_eq!(lines(&thing("shape = { }")), ["5:9 thing[0].shape: missing key: one of `box`, `sphere`"]);
}

#[test]
fn untagged_values_are_judged_by_the_best_fit() {
    for size in ["2", "[1, 2, 3]", "{ width_m = 1, height_m = 2 }"] {
        assert!(parse::<Room>(&thing(&format!("mesh = \"m\"\nsize = {size}")), "a").is_ok(), "{size}");
    }
    let size = |size: &str| lines(&thing(&format!("mesh = \"m\"\nsize = {size}")));
    assert_eq!(size("[1, 2]"), ["6:8 thing[0].size: expected 3 elements, found 2"]);
    assert_eq!(
        size("{ width_m = 1, heigt_m = 2 }"),
        ["6:23 thing[0].size.heigt_m: unknown key = did you mean `height_m`?"]
    );
    assert_eq!(
        size("true"),
        ["6:8 thing[0].size: expected a number or an array of 3, each a number or a table, found `true`"]
    );
}

#[test]
fn all_syntax_errors_are_reported_with_their_places() {
    let found = lines("version = \n[camera\nsource = \"a\"\n");
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].starts_with("1:11 : not valid TOML: "), "{found:?}");
    assert!(found[1].starts_with("2:8 : not valid TOML: "), "{found:?}");
    let duplicate = lines("version = 1\nversion = 2");
    assert_eq!(duplicate, ["2:1 : not valid TOML: duplicate key"]);
}

#[test]
fn a_problem_is_printed_with_its_source_line() {
    let text = thing("mesh = \"m\"\npose = { in = \"world\", positon_m = [0, 0, 0] }");
    assert_eq!(
        problems(&text)[0].to_string(),
        "room.toml:6:24: error: thing[0].pose.positon_m: unknown key
  |
6 | pose = { in = \"world\", positon_m = [0, 0, 0] }
  |                        ^^^^^^^^^
  = did you mean `position_m`?"
    );
}

#[test]
fn other_crates_report_at_the_place_of_a_key() {
    let text = "version = 1\n[camera]\nsource = \"a\"\nsize_px = [0, 480]\n[[thing]]\nname = \"t\"\nworld = \"real\"\nmesh = \"m\"\n";
    let document: Document<Room> = Document::parse(text, "room.toml").unwrap();
    let place = |problem: Problem| (problem.line, problem.column, problem.key);
    assert_eq!(
        place(document.error_at(["camera", "size_px"], "no pixels", "")),
        (4, 11, "camera.size_px".to_owned())
    );
    assert_eq!(
        place(document.error_at_key(["camera", "size_px"], "no pixels", "")),
        (4, 1, "camera.size_px".to_owned())
    );
    assert_eq!(
        place(document.error_at(["camera", "size_px", "0"], "", "")),
        (4, 12, "camera.size_px[0]".to_owned())
    );
    assert_eq!(place(document.error_at(["thing", "0", "name"], "", "")), (6, 8, "thing[0].name".to_owned()));
    assert_eq!(place(document.error_at(["thing", "0", "pose"], "", "")), (5, 1, "thing[0].pose".to_owned()));
    assert_eq!(place(document.error_at(["rig"], "", "")), (1, 1, "rig".to_owned()));
    assert!(document.contains(["camera", "source"]) && !document.contains(["camera", "gain"]));
}

#[test]
fn places_hold_with_crlf_and_a_byte_order_mark() {
    let found = lines("\u{feff}vesion = 1\r\n[camera]\r\nsource = \"a\"\r\n\"ß\" = 1\r\n");
    assert_eq!(found[0], "1:1 vesion: unknown key = did you mean `version`?");
    assert!(found[1].starts_with("4:1 "), "{found:?}");
}
