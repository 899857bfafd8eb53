//! The session file: the documented example, every contradiction with its place, saving, assembling.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "clippy knows only functions marked as tests as tests"
)]

use std::fs;
use std::path::Path;

use coshade_config::{Problem, Severity};
use coshade_scene::session::light::LightKindSpec;
use coshade_scene::session::placement::{Placement, PoseSpec};
use coshade_scene::session::render::{Method, RenderSpec};
use coshade_scene::session::sensors::Mount;
use coshade_scene::session::thing::{Form, ShapeKind};
use coshade_scene::session::tracking::{AnchorTarget, NamedUp, Up};
use coshade_scene::{LightKind, Pose, Session, SessionSpec, World};

/// The example of the documentation, as printed there.
const EXAMPLE: &str = include_str!("data/session/design.toml");
const FULL: &str = include_str!("data/session/full.toml");

const SMALL: &str = "version = 1\n[camera]\nsource = \"replay:a.mcap\"\n[environment]\nfile = \"a.hdr\"\n";
const TRACKING: &str = "[tracking]\nanchor = { board = \"board.toml\" }\n";

fn session(text: &str) -> Session {
    Session::parse(text, "desk.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn line(problem: &Problem) -> String {
    let help = problem.help.as_ref().map(|help| format!(" = {help}")).unwrap_or_default();
    format!("{}:{} {}: {}{help}", problem.line, problem.column, problem.key, problem.message)
}

/// `line:column key: message = help` of every problem.
fn errors(text: &str) -> Vec<String> {
    match Session::parse(text, "desk.toml") {
        Ok(_) => panic!("no problem in\n{text}"),
        Err(error) => error.problems().iter().map(line).collect(),
    }
}

fn warnings(text: &str) -> Vec<String> {
    let problems = session(text).check();
    let warnings = problems.iter().filter(|problem| problem.severity == Severity::Warning);
    warnings.map(line).filter(|line| !line.contains("/dev/")).collect()
}

#[test]
fn the_documented_example_is_read_as_printed() {
    let session = session(EXAMPLE);
    let spec = session.spec();
    assert_eq!(spec.rig.as_deref(), Some(Path::new("rig.toml")));
    assert_eq!(spec.camera.source, "v4l:/dev/video0");
    let fisheye = spec.fisheye.as_ref().unwrap();
    assert_eq!((fisheye.mount, fisheye.pose.is_none()), (Mount::World, true));
    assert_eq!(spec.depth.as_ref().unwrap().source, "v4l:/dev/video4");
    let tracking = spec.tracking.as_ref().unwrap();
    assert_eq!(tracking.anchor.up, Up::Named(NamedUp::Z));
    assert!(
        matches!(&tracking.anchor.target, AnchorTarget::Board { board } if board == Path::new("board.toml"))
    );
    assert!(tracking.filter);
    let [desk, bunny] = spec.things.as_slice() else { panic!("{:?}", spec.things) };
    assert_eq!((desk.name.as_str(), desk.world), ("desk", World::Real));
    assert!(matches!(&desk.form, Form::Shape(shape) if shape.kind == ShapeKind::Box([1.2, 0.8, 0.03])));
    assert_eq!(desk.pose.placement().position_m, [0.0, 0.0, -0.015]);
    assert!(bunny.hide_marker && bunny.form == Form::Mesh("bunny.glb".into()));
    let PoseSpec::Marker { tag, placement } = &bunny.pose else { panic!("{:?}", bunny.pose) };
    assert_eq!((tag.family.as_str(), tag.id, tag.size_m, placement.scale), ("tag36h11", 7, 0.05, Some(0.1)));
    let LightKindSpec::Spot { radiant_intensity, cone_deg, radius_m } = &spec.lights[0].kind else {
        panic!()
    };
    assert_eq!((*radiant_intensity, *cone_deg, *radius_m), (Some([8.0, 8.0, 7.0]), [20.0, 30.0], 0.005));
    assert_eq!((spec.render.method, spec.render.vpls), (Method::Dir, 256));
}

#[test]
fn the_lamp_has_its_documented_default_radius() {
    let session = session(&EXAMPLE.replace("radius_m = 0.005\n", ""));
    let LightKindSpec::Spot { radius_m, .. } = &session.spec().lights[0].kind else { panic!() };
    assert_eq!(*radius_m, 0.005);
}

#[test]
fn defaults_of_rendering_are_those_of_the_papers() {
    let render = session(SMALL).spec().render;
    assert_eq!(render, RenderSpec::default());
    assert_eq!((render.vpls, render.ism_size_px, render.points_per_vpl, render.split), (256, 128, 1024, 4));
    assert_eq!((render.linear_steps, render.binary_steps, render.specular_bounces), (64, 8, 3));
}

#[test]
fn every_section_is_read_and_a_session_survives_its_own_writing() {
    for text in [EXAMPLE, FULL] {
        let spec = session(text).spec().clone();
        let written = Session::new(&spec, "desk.toml").unwrap();
        assert_eq!(written.spec(), &spec);
        assert_eq!(session(written.text()).spec(), &spec);
    }
}

#[test]
fn unknown_keys_name_the_nearest_known_one() {
    let text = EXAMPLE
        .replace("hide_marker", "hide_markers")
        .replace("position_m = [0, 0, -0.015]", "positon_m = [0, 0, -0.015]")
        .replace("cone_deg", "cone")
        .replace("vpls", "vpl")
        .replace("up = \"z\"", "pu = \"z\"");
    assert_eq!(
        errors(&text),
        [
            "14:34 tracking.anchor.pu: unknown key = did you mean `up`?",
            "19:24 thing[0].pose.positon_m: unknown key = did you mean `position_m`?",
            "25:1 thing[1].hide_markers: unknown key = did you mean `hide_marker`?",
            "31:1 light[0].cone: unknown key = did you mean `cone_deg`?",
            "35:1 render.vpl: unknown key = did you mean `vpls`?",
        ]
    );
}

#[test]
fn values_out_of_range_are_refused_at_their_place() {
    let text = EXAMPLE
        .replace("vpls = 256", "vpls = 0")
        .replace("size_m = 0.05, scale = 0.1", "size_m = -0.05, scale = 0")
        .replace("[8, 8, 7]", "[8, -8, inf]")
        .replace("[20, 30]", "[20, 91]")
        .replace("\"dir\"", "\"drr\"")
        .replace("version = 1", "version = 2");
    assert_eq!(
        errors(&text),
        [
            "1:11 version: `2` is out of range = allowed: 1 only",
            "24:63 thing[1].pose.size_m: `-0.05` is out of range = allowed: greater than 0",
            "24:78 thing[1].pose.scale: `0` is out of range = allowed: greater than 0",
            "30:25 light[0].radiant_intensity[1]: `-8` is out of range = allowed: at least 0",
            "30:29 light[0].radiant_intensity[2]: expected a finite number, found `inf`",
            "31:17 light[0].cone_deg[1]: `91` is out of range = allowed: from 0 to 90",
            "34:10 render.method: unknown value `\"drr\"` = did you mean `dir`? Allowed: `dir`, `dic`, `reference`",
            "35:8 render.vpls: `0` is out of range = allowed: from 1 to 65536",
        ]
    );
}

#[test]
fn a_thing_has_one_form() {
    let thing = |rest: &str| errors(&format!("{SMALL}[[thing]]\nname = \"a\"\nworld = \"real\"\n{rest}\n"));
    assert_eq!(thing(""), ["6:1 thing[0]: missing key: one of `mesh`, `shape`"]);
    assert_eq!(
        thing("mesh = \"a.glb\"\nshape = { sphere = 1 }"),
        [
            "10:1 thing[0].shape: `shape` beside `mesh`, of which only one is allowed = give one of `mesh`, `shape`"
        ]
    );
    assert_eq!(
        thing("shape = { spere = 1 }"),
        ["9:11 thing[0].shape.spere: unknown key = did you mean `sphere`?"]
    );
    assert_eq!(
        thing("mesh = \"a.stl\""),
        ["9:8 thing[0].mesh: unknown kind of mesh = allowed: .glb, .gltf, .obj, .ply"]
    );
    assert_eq!(
        thing("shape = { box = [1, 0, 1] }\nmesh_up = \"y\""),
        [
            "9:21 thing[0].shape.box[1]: 0 is no length = allowed: from 1e-9 to 1e6 metres",
            "10:11 thing[0].mesh_up: only for things with a mesh file = remove it",
        ]
    );
    assert_eq!(
        thing("shape = { ring = { inner_radius_m = 2, outer_radius_m = 1, height_m = 1 } }"),
        ["9:57 thing[0].shape.ring.outer_radius_m: not larger than inner_radius_m = 2"]
    );
}

#[test]
fn sources_and_calibrations_are_checked() {
    let text = "version = 1\n[camera]\nsource = \"v4l:/dev/video0\"\n[fisheye]\nsource = \"v4l:/dev/video0\"\ncalibration = \"f.toml\"\nmount = \"rig\"\n[depth]\nsource = \"kinect:0\"\n";
    assert_eq!(
        errors(text),
        [
            "2:1 camera.calibration: missing key: this source brings no calibration along = calibrate it and write \
             calibration = \"camera.toml\"",
            "5:10 fisheye.source: the device of [camera]: it can only be opened once",
            "7:9 fisheye.mount: mount = \"rig\" without a rig file = add rig = \"rig.toml\" at the top",
            "9:10 depth.source: unknown kind of source `kinect`; known are `v4l:/dev/video0`, `nokhwa:0`, \
             `replay:desk.mcap#camera`, `images:photos/*.png`, `sim:desk.toml#camera`",
        ]
    );
}

#[test]
fn light_comes_from_one_side_only() {
    let text = format!(
        "{SMALL}[fisheye]\nsource = \"replay:a.mcap#f\"\nmount = \"rig\"\npose = {{ in = \"world\" }}\n"
    );
    assert_eq!(
        errors(&text),
        [
            "4:1 environment: [environment] beside [fisheye]: both say where light comes from = remove one of them",
            "9:8 fisheye.pose: a pose beside mount = \"rig\" = remove it: the rig file says where the fish-eye is; or \
             write mount = \"world\"",
        ]
    );
    assert_eq!(
        warnings("version = 1\n[camera]\nsource = \"sim:w.toml#c\"\n"),
        ["1:1 : there is no light: virtual things will be black = add [fisheye], [environment] or [[light]]"]
    );
    assert!(warnings(EXAMPLE)[0].starts_with("9:9 fisheye.mount: no pose: "), "{:?}", warnings(EXAMPLE));
}

#[test]
fn a_camera_stands_still_or_is_tracked() {
    let text = "version = 1\n[camera]\nsource = \"sim:w.toml#c\"\npose = { in = \"POSE }\n[[light]]\nkind = \"spot\"\n\
                world = \"real\"\nradiant_intensity = [1, 1, 1]\ncone_deg = [20, 30]\npose = { in = \"world\" }\n";
    let still = session(&text.replace("POSE", "world\", look_at_m = [1, 0, 0]"));
    let pose = still.pose(still.spec().camera.pose.as_ref().unwrap()).unwrap();
    let ahead = pose.frame_from_thing().transform_direction(glam::Vec3::Z);
    assert!((ahead - glam::Vec3::X).length() < 1e-6);
    assert_eq!(
        errors(&text.replace("POSE", "world\", scale = 2")),
        ["4:32 camera.pose.scale: a camera has no scale = remove it"]
    );
    let tracked = text.replace("POSE", "marker\", family = \"tag36h11\", id = 1, size_m = 0.1")
        + "[tracking]\nanchor = { family = \"tag36h11\", id = 1, size_m = 0.1 }\n";
    assert_eq!(
        errors(&tracked),
        [
            "4:8 camera.pose: a camera that stands still beside [tracking] = remove one of them",
            "4:15 camera.pose.in: a camera that stands still is in the world = write in = \"world\"",
        ]
    );
}

#[test]
fn names_are_unique() {
    let thing = "[[thing]]\nname = \"a\"\nworld = \"real\"\nmesh = \"a.glb\"\n";
    assert_eq!(
        errors(&format!("{SMALL}{thing}{thing}")),
        ["11:8 thing[1].name: name given to thing[0] already = names must be unique"]
    );
}

#[test]
fn tags_belong_to_families_have_one_size_and_need_tracking() {
    let thing = |name: &str, pose: &str| {
        format!(
            "[[thing]]\nname = \"{name}\"\nworld = \"real\"\nmesh = \"a.glb\"\npose = {{ in = \"marker\", {pose} }}\n"
        )
    };
    let last = |family: &str, id: u32| format!("family = \"{family}\", id = {id}, size_m = 0.1");
    assert_eq!(
        errors(&format!("{SMALL}{}", thing("a", &last("tag36h11", 0)))),
        [
            "10:15 thing[0].pose.in: attached to something tracked, but there is no [tracking] = add [tracking] with \
             anchor = { board = \"board.toml\" }"
        ]
    );
    let tracked = |things: &str| format!("{SMALL}{TRACKING}{things}");
    // The last tag of each family is there, the one after it is not (`ncodes` of the AprilTag library).
    for (family, count) in [
        ("tag36h11", 587),
        ("tag25h9", 35),
        ("tag16h5", 30),
        ("tagStandard41h12", 2115),
        ("tagCircle21h7", 38),
    ] {
        assert!(Session::parse(&tracked(&thing("a", &last(family, count - 1))), "a").is_ok(), "{family}");
        let errors = errors(&tracked(&thing("a", &last(family, count))));
        let expected =
            format!("thing[0].pose.id: {family} has no tag {count} = allowed: from 0 to {}", count - 1);
        assert!(errors.len() == 1 && errors[0].ends_with(&expected), "{errors:?}");
    }
    assert_eq!(
        errors(&tracked(&thing("a", &last("tag36h1", 0)))),
        ["12:34 thing[0].pose.family: unknown tag family `tag36h1` = did you mean `tag36h11`?"]
    );
    let two = thing("a", &last("tag36h11", 3)) + &thing("b", "family = \"tag36h11\", id = 3, size_m = 0.2");
    assert_eq!(
        errors(&tracked(&two)),
        [
            "17:63 thing[1].pose.size_m: tag 3 of tag36h11 is 0.1 m elsewhere in this file = one tag has one size"
        ]
    );
}

#[test]
fn a_rotation_is_given_once_and_is_one() {
    let pose = |pose: &str| {
        errors(&format!(
            "{SMALL}[[thing]]\nname = \"a\"\nworld = \"real\"\nmesh = \"a.glb\"\npose = {{ in = \"world\", {pose} }}\n"
        ))
    };
    assert_eq!(
        pose("rotation_deg = [0, 0, 1], quaternion_xyzw = [0, 0, 0, 1]"),
        [
            "10:68 thing[0].pose.quaternion_xyzw: `quaternion_xyzw` beside `rotation_deg`, of which only one is allowed"
        ]
    );
    assert_eq!(
        pose("quaternion_xyzw = [0, 0, 0, 1.01]"),
        ["10:42 thing[0].pose.quaternion_xyzw: a quaternion of length 1.01; unit length is needed"]
    );
    assert_eq!(
        pose("axis_angle = { axis = [0, 0, 0], angle_deg = 3 }"),
        ["10:37 thing[0].pose.axis_angle: an axis of length 0 has no direction"]
    );
    assert_eq!(
        pose("position_m = [1, 2, 3], look_at_m = [1, 2, 3]"),
        ["10:60 thing[0].pose.look_at_m: its own position; there is no direction to look in"]
    );
    assert_eq!(
        pose("position_m = [0, 1e7, nan]"),
        ["10:46 thing[0].pose.position_m[2]: expected a finite number, found `nan`"]
    );
    assert_eq!(pose("id = 3"), ["10:24 thing[0].pose.id: unknown key = it belongs to in = \"marker\""]);
}

#[test]
fn lights_have_a_strength_and_a_cone() {
    let light = |rest: &str| errors(&format!("{SMALL}[[light]]\nkind = \"spot\"\n{rest}\n"));
    assert_eq!(
        light("world = \"real\"\ncone_deg = [30, 20]\nfit = true\nradiant_intensity = [1, 1, 1]"),
        [
            "9:12 light[0].cone_deg: inner angle 30 is larger than outer angle 20 = write [inner, outer]",
            "10:7 light[0].fit: fit = true beside `radiant_intensity` = remove one of them",
        ]
    );
    assert_eq!(
        light("world = \"virtual\"\ncone_deg = [20, 30]"),
        [
            "6:1 light[0].radiant_intensity: missing key: how strong the light is = or fit = true, to measure a real \
             light"
        ]
    );
    assert_eq!(
        light("world = \"virtual\"\ncone_deg = [20, 30]\nfit = true"),
        ["10:7 light[0].fit: a virtual light cannot be measured = give `radiant_intensity`"]
    );
    assert_eq!(
        light("world = \"virtual\"\nsize_m = [1, 1]\ncone_deg = [20, 30]\nradiant_intensity = [1, 1, 1]"),
        ["9:1 light[0].size_m: unknown key = it belongs to kind = \"area\""]
    );
}

#[test]
fn materials_do_not_say_things_twice() {
    let text = format!(
        "{SMALL}[[thing]]\nname = \"a\"\nworld = \"real\"\nmesh = \"a.glb\"\n[thing.material]\nroughness = 0.5\nphong_exponent = 3\neta = [1, 1, 1]\nattenuation_color = [1, 1, 0.5]\n"
    );
    assert_eq!(
        errors(&text),
        [
            "12:18 thing[0].material.phong_exponent: `phong_exponent` beside `roughness`: both say how dull it is",
            "13:7 thing[0].material.eta: `eta` without `k`",
            "14:21 thing[0].material.attenuation_color: one of two keys that only mean something together = \
             attenuation_color is the colour left after attenuation_distance_m",
        ]
    );
}

/// The example with all its files in a folder. The lens files are the simplest that are valid.
fn desk(folder: &Path) -> Session {
    let calibration = "version = 1\nsize_px = [640, 480]\n[lens]\nmodel = \"pinhole\"\nfx = 500\nfy = 500\ncx = 319.5\ncy = 239.5\n";
    let rig = "version = 1\n[sensor.camera]\n[sensor.fisheye]\nposition_m = [0, 0.1, 0]\n";
    let board = "version = 1\nfamily = \"tag36h11\"\n[[tag]]\nid = 0\nsize_m = 0.04\nposition_m = [0, 0]\n";
    for (name, text) in [
        ("camera.toml", calibration),
        ("fisheye.toml", calibration),
        ("rig.toml", rig),
        ("board.toml", board),
        ("session.toml", EXAMPLE),
    ] {
        fs::write(folder.join(name), text).unwrap();
    }
    fs::write(folder.join("bunny.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let text = EXAMPLE.replace("bunny.glb", "bunny.obj");
    fs::write(folder.join("session.toml"), text).unwrap();
    Session::read(folder.join("session.toml")).unwrap()
}

fn file_errors(session: &Session) -> Vec<String> {
    let problems = session.check();
    problems.iter().filter(|problem| problem.is_error()).map(|problem| problem.key.clone()).collect()
}

#[test]
fn a_session_with_all_its_files_has_no_errors() {
    let folder = tempfile::tempdir().unwrap();
    let session = desk(folder.path());
    let errors: Vec<String> =
        session.check().iter().filter(|p| p.is_error()).map(ToString::to_string).collect();
    assert!(errors.is_empty(), "{}", errors.join("\n"));
}

#[test]
fn every_missing_file_is_told_at_its_key() {
    let folder = tempfile::tempdir().unwrap();
    let session = desk(folder.path());
    for name in ["camera.toml", "fisheye.toml", "rig.toml", "board.toml", "bunny.obj"] {
        fs::remove_file(folder.path().join(name)).unwrap();
    }
    assert_eq!(
        file_errors(&session),
        ["rig", "camera.calibration", "fisheye.calibration", "tracking.anchor.board", "thing[1].mesh"]
    );
    let first = session.check()[0].clone();
    assert_eq!((first.line, first.column), (2, 7));
    assert!(first.message.contains("rig.toml"), "{first}");
}

#[test]
fn damaged_files_are_told_with_their_own_places() {
    let folder = tempfile::tempdir().unwrap();
    let session = desk(folder.path());
    fs::write(folder.path().join("rig.toml"), "version = 1\n[sensor.camera]\nreadout = 1\n").unwrap();
    let problems = session.check();
    let rig = problems.iter().find(|problem| problem.key == "rig").unwrap();
    assert!(rig.message.contains("rig.toml:3:1: error: sensor.camera.readout"), "{rig}");
    assert!(rig.message.contains("did you mean `readout_s`"), "{rig}");
}

#[test]
fn damaged_boards_and_bodies_are_told_with_their_own_places() {
    let folder = tempfile::tempdir().unwrap();
    let session = desk(folder.path());
    let cube =
        "version = 1\nfamily = \"tag36h11\"\n[[tag]]\nid = 600\nsize_m = 0.04\nposition_m = [0, 0, 1]\n";
    fs::write(folder.path().join("board.toml"), cube.replace("600", "6").replace("size_m", "size")).unwrap();
    fs::write(folder.path().join("cube.toml"), cube).unwrap();
    let mut spec = session.spec().clone();
    let body = PoseSpec::Body { body: "cube.toml".into(), placement: Placement::default() };
    spec.things[0].pose = body;
    let session = Session::new(&spec, folder.path().join("session.toml")).unwrap();
    let problems = session.check();
    let told = |key: &str, what: &str| {
        let problem = problems.iter().find(|problem| problem.key == key);
        let problem = problem.unwrap_or_else(|| panic!("{key}: nothing is told")).to_string();
        assert!(problem.contains(what), "{problem}");
    };
    told("tracking.anchor.board", "board.toml:5:1: error: tag[0].size: unknown key");
    told("thing[0].pose.body", "cube.toml:4:6: error: tag[0].id: tag36h11 has no tag 600");
}

#[test]
fn saving_keeps_every_byte_that_did_not_change() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = desk(folder.path());
    let path = folder.path().join("session.toml");
    let before = fs::read_to_string(&path).unwrap();
    session.save().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), before);

    let mut spec: SessionSpec = session.spec().clone();
    spec.render.vpls = 64;
    spec.fisheye.as_mut().unwrap().pose = Some(PoseSpec::default());
    session.set(&spec).unwrap();
    session.save().unwrap();
    let expected = before
        .replace("vpls = 256", "vpls = 64")
        .replace("# rig | world\n", "# rig | world\npose = { in = \"world\" }\n");
    assert_eq!(fs::read_to_string(&path).unwrap(), expected);
}

#[test]
fn a_change_that_contradicts_itself_is_refused() {
    let mut session = session(EXAMPLE);
    let mut spec = session.spec().clone();
    spec.tracking = None;
    let error = session.set(&spec).unwrap_err();
    assert!(error.to_string().contains("there is no [tracking]"), "{error}");
    assert_eq!(session.text(), EXAMPLE);
}

#[test]
fn a_session_becomes_a_scene() {
    let assembled = session(FULL).assemble().unwrap();
    let scene = &assembled.scene;
    let names: Vec<&str> = scene.things.iter().map(|thing| thing.name.as_str()).collect();
    assert_eq!(names, ["table", "ball", "ring", "teapot", "wall"]);
    for thing in &scene.things {
        thing.mesh.check().unwrap();
        for (part, _) in thing.mesh.parts.iter().enumerate() {
            assert!(thing.material_of(part).is_some(), "{}", thing.name);
        }
        assert!(thing.pose.frame_from_thing().is_valid());
    }
    assert!((scene.things[0].mesh.volume_m3() - 1.2 * 0.8 * 0.03).abs() < 1e-6);
    let ball = &scene.things[1].materials[0];
    assert!(ball.is_refractor() && ball.roughness == 0.0 && ball.attenuation_distance_m == 0.1);
    let ring = &scene.things[2];
    assert!(
        matches!(&ring.pose, Pose::Marker { family, id: 7, .. } if family == "tag36h11") && ring.hide_marker
    );
    // Gold: ((0.143 − 1)² + 3.983²)/((0.143 + 1)² + 3.983²) = 0.9667; α = √(2/1002), roughness = √α.
    let gold = &ring.materials[0];
    assert!((gold.base_color.x - 0.9667).abs() < 1e-3 && gold.metallic == 1.0, "{gold:?}");
    assert!((gold.alpha() - (2.0_f32 / 1002.0).sqrt()).abs() < 1e-6);
    assert_eq!(scene.things[3].pose.frame_from_thing().scale, 2.0);
    assert_eq!(assembled.lights_to_fit, [0]);
    let LightKind::Spot(spot) = scene.lights[0].kind else { panic!() };
    assert!((spot.outer_rad - 30_f32.to_radians()).abs() < 1e-7 && spot.radius_m == 0.005);
    assert!(matches!(scene.lights[1].kind, LightKind::Rectangle(panel) if panel.size_m.x == 0.6));
    assert_eq!(scene.lights[1].name, "panel");
}

#[test]
fn a_mesh_that_cannot_be_read_is_told_at_its_key() {
    let folder = tempfile::tempdir().unwrap();
    let session = desk(folder.path());
    assert_eq!(session.assemble().unwrap().scene.things.len(), 2);
    fs::write(folder.path().join("bunny.obj"), "v 0 0 zero\nf 1 2 3\n").unwrap();
    let error = session.assemble().unwrap_err();
    assert_eq!(error.problems.len(), 1);
    assert_eq!(error.problems[0].key, "thing[1].mesh");
    assert!(error.to_string().contains("bunny.obj"), "{error}");
}
