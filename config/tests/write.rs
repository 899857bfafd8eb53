//! Changed values go back into the file, and nothing else changes.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

use std::fs;

use coshade_config::{Document, Error};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
struct Room {
    version: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    rig: Option<String>,
    camera: Camera,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    thing: Vec<Thing>,
    #[serde(default)]
    render: Render,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    table: Vec<[f64; 3]>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
struct Camera {
    source: String,
    #[serde(default)]
    gain: f64,
    size_px: [u32; 2],
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
struct Thing {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<Pose>,
    #[serde(default)]
    hidden: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "in", rename_all = "lowercase")]
enum Pose {
    World { position_m: [f64; 3] },
    Marker { id: u32, size_m: f64 },
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
struct Render {
    vpls: u32,
    epsilon: f64,
}

impl Default for Render {
    fn default() -> Self {
        Self { vpls: 256, epsilon: 0.1 }
    }
}

const ROOM: &str = "# A room.

version = 1 # of the format

[camera] # see-through
size_px = [ 640,480 ]   # wide
source  = 'v4l:/dev/video0'
# trailing words

[[thing]]
name = \"desk\" # oak
pose = { in = \"world\", position_m = [0, 0.50, 0x10] }

# The bunny.
[[thing]]
name = \"bunny\"
[thing.pose] # by marker
in = \"marker\"
id = 7
size_m = 5e-2
# the end
";

fn changed(text: &str, change: impl FnOnce(&mut Room)) -> String {
    let mut document: Document<Room> = Document::parse(text, "room.toml").unwrap();
    let mut room = document.value().clone();
    change(&mut room);
    document.set(&room).unwrap();
    assert_eq!(document.value(), &room);
    document.text().to_owned()
}

#[test]
fn no_change_changes_no_byte() {
    assert_eq!(changed(ROOM, |_| ()), ROOM);
    let crlf = format!("\u{feff}{}", ROOM.replace('\n', "\r\n"));
    assert_eq!(changed(&crlf, |_| ()), crlf);
}

#[test]
fn a_changed_number_changes_only_itself() {
    let text = changed(ROOM, |room| room.camera.size_px[1] = 360);
    assert_eq!(text, ROOM.replace("[ 640,480 ]", "[ 640,360 ]"));
    let text = changed(ROOM, |room| room.thing[1].pose = Some(Pose::Marker { id: 9, size_m: 0.05 }));
    assert_eq!(text, ROOM.replace("id = 7", "id = 9"));
    // What was written without a decimal point stays so.
    let text = changed(ROOM, |room| room.thing[0].pose = Some(Pose::World { position_m: [2.0, 0.5, 16.0] }));
    assert_eq!(text, ROOM.replace("[0, 0.50", "[2, 0.50"));
    let text = changed(ROOM, |room| room.camera.source = "sim:desk.toml#camera".to_owned());
    assert_eq!(text, ROOM.replace("'v4l:/dev/video0'", "\"sim:desk.toml#camera\""));
}

#[test]
fn line_ends_and_byte_order_mark_stay_when_something_changes() {
    let crlf = format!("\u{feff}{}", ROOM.replace('\n', "\r\n"));
    let text = changed(&crlf, |room| room.camera.size_px[1] = 360);
    assert_eq!(text, crlf.replace("[ 640,480 ]", "[ 640,360 ]"));
}

#[test]
fn new_keys_follow_their_neighbour_and_defaults_stay_away() {
    let text = changed(ROOM, |room| room.rig = Some("rig.toml".to_owned()));
    assert_eq!(text, ROOM.replace("# of the format\n", "# of the format\nrig = \"rig.toml\"\n"));
    let text = changed(ROOM, |room| room.camera.gain = 2.5);
    assert_eq!(text, ROOM.replace("video0'\n", "video0'\ngain = 2.5\n"));
    let text = changed(ROOM, |room| room.thing[0].hidden = true);
    assert_eq!(text, ROOM.replace("0x10] }\n", "0x10] }\nhidden = true\n"));
}

#[test]
fn of_a_new_section_only_what_differs_from_the_defaults_is_written() {
    let text = changed(ROOM, |room| room.render.vpls = 64);
    assert!(text.contains("\n\n[render]\nvpls = 64\n"), "{text}");
    assert!(!text.contains("epsilon"), "{text}");
    assert_eq!(text.replace("\n[render]\nvpls = 64\n", ""), ROOM);
}

#[test]
fn removed_keys_take_nothing_else_along() {
    let text = changed(ROOM, |room| room.thing[0].pose = None);
    assert_eq!(text, ROOM.replace("pose = { in = \"world\", position_m = [0, 0.50, 0x10] }\n", ""));
    let text = changed(ROOM, |room| {
        room.thing.remove(0);
    });
    let desk =
        "\n[[thing]]\nname = \"desk\" # oak\npose = { in = \"world\", position_m = [0, 0.50, 0x10] }\n";
    assert_eq!(text, ROOM.replace(desk, ""));
    let text = changed(ROOM, |room| room.thing.clear());
    assert!(!text.contains("thing") && text.ends_with("# the end\n"), "{text}");
}

#[test]
fn a_tag_can_change_and_takes_its_keys_along() {
    let text = changed(ROOM, |room| room.thing[0].pose = Some(Pose::Marker { id: 3, size_m: 0.1 }));
    assert_eq!(
        text,
        ROOM.replace(
            "{ in = \"world\", position_m = [0, 0.50, 0x10] }",
            "{ in = \"marker\", id = 3, size_m = 0.1 }"
        )
    );
}

#[test]
fn elements_are_added_moved_and_changed_with_their_comments() {
    let lamp = Thing { name: "lamp".to_owned(), pose: None, hidden: true };
    let text = changed(ROOM, |room| room.thing.insert(1, lamp.clone()));
    let new = "\n[[thing]]\nname = \"lamp\"\nhidden = true\n";
    assert_eq!(text, ROOM.replace("\n# The bunny.", &format!("{new}\n# The bunny.")));
    let text = changed(ROOM, |room| room.thing.push(lamp.clone()));
    assert!(text.contains("size_m = 5e-2\n"), "{text}");
    let (first, second) = (text.find("bunny").unwrap(), text.find("lamp").unwrap());
    assert!(first < second, "{text}");
    let text = changed(ROOM, |room| room.thing.swap(0, 1));
    let (bunny, oak) = (text.find("# The bunny.\n[[thing]]").unwrap(), text.find("# oak").unwrap());
    assert!(bunny < text.find("by marker").unwrap() && text.find("by marker").unwrap() < oak, "{text}");
}

#[test]
fn arrays_keep_the_lines_they_are_written_on() {
    let text = "version = 1
table = [
    [1, 2, 3], # first
    [4, 5, 6],
]
[camera]
source = \"a\"
size_px = [1, 2]
";
    let grown = changed(text, |room| room.table.push([7.0, 8.0, 9.5]));
    assert_eq!(grown, text.replace("[4, 5, 6],\n", "[4, 5, 6],\n    [7.0, 8.0, 9.5],\n"));
    let shrunk = changed(text, |room| {
        room.table.pop();
    });
    assert!(shrunk.contains("    [1, 2, 3], # first\n"), "{shrunk}");
    let edited = changed(text, |room| room.table[1][1] = 50.0);
    assert_eq!(edited, text.replace("[4, 5, 6]", "[4, 50, 6]"));
}

#[test]
fn a_value_that_cannot_be_read_back_is_refused_and_nothing_changes() {
    let mut document: Document<Room> = Document::parse(ROOM, "room.toml").unwrap();
    let mut room = document.value().clone();
    room.camera.gain = f64::NAN;
    let error = document.set(&room).unwrap_err();
    assert!(matches!(error, Error::Unwritable { .. }), "{error}");
    assert!(error.to_string().contains("camera.gain"), "{error}");
    assert_eq!(document.text(), ROOM);
}

#[test]
fn a_new_file_has_sections_and_lines_of_readable_length() {
    let room = Room {
        version: 1,
        rig: None,
        camera: Camera { source: "a".to_owned(), gain: 1.0, size_px: [640, 480] },
        thing: vec![Thing { name: "desk".to_owned(), pose: None, hidden: false }],
        render: Render::default(),
        table: (0..20).map(|i| [f64::from(i), 0.125, 0.25]).collect(),
    };
    let document = Document::new(&room, "room.toml").unwrap();
    assert_eq!(document.value(), &room);
    let text = document.text();
    assert!(text.starts_with("version = 1\ntable = [\n    [0.0, 0.125, 0.25], "), "{text}");
    assert!(
        text.contains("\n\n[camera]\nsource = \"a\"\ngain = 1.0\nsize_px = [640, 480]\n\n[[thing]]\n"),
        "{text}"
    );
    assert!(text.lines().all(|line| line.len() <= 110), "{text}");
}

#[test]
fn saving_replaces_the_file_as_a_whole_and_leaves_nothing_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.toml");
    fs::write(&path, ROOM).unwrap();
    let mut document: Document<Room> = Document::read(&path).unwrap();
    let before = fs::metadata(&path).unwrap().modified().unwrap();
    document.save().unwrap();
    assert_eq!(fs::metadata(&path).unwrap().modified().unwrap(), before, "nothing to write");

    let mut room = document.value().clone();
    room.version = 2;
    document.set(&room).unwrap();
    document.save().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), ROOM.replace("version = 1", "version = 2"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);

    // A second save after a second change, without reading again.
    room.version = 3;
    document.set(&room).unwrap();
    document.save().unwrap();
    assert_eq!(coshade_config::read::<Room>(&path).unwrap(), room);
}

#[test]
fn a_file_that_another_program_changed_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("room.toml");
    fs::write(&path, ROOM).unwrap();
    let mut document: Document<Room> = Document::read(&path).unwrap();
    let mut room = document.value().clone();
    room.version = 2;
    document.set(&room).unwrap();
    let theirs = format!("{ROOM}# theirs\n");
    fs::write(&path, &theirs).unwrap();
    assert!(matches!(document.save(), Err(Error::ChangedOnDisk { .. })));
    assert_eq!(fs::read_to_string(&path).unwrap(), theirs);
}

#[cfg(unix)]
#[test]
fn links_and_permissions_survive_saving() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let (path, link) = (folder.path().join("room.toml"), folder.path().join("link.toml"));
    fs::write(&path, ROOM).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    symlink(&path, &link).unwrap();
    let mut document: Document<Room> = Document::read(&link).unwrap();
    let mut room = document.value().clone();
    room.version = 2;
    document.set(&room).unwrap();
    document.save().unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    assert!(fs::read_to_string(&path).unwrap().contains("version = 2"));
}
