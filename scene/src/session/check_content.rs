//! What in a session contradicts itself.

use std::collections::HashMap;

use coshade_config::{Document, KeyPath, Problem};

use super::SessionSpec;
use super::family::{FAMILIES, tags_of};
use super::light::{LightKindSpec, LightSpec};
use super::placement::{Placement, PoseSpec, Tag};
use super::sensors::{FisheyeSpec, Mount, RoomForm};
use super::source::{SourceScheme, SourceUri};
use super::thing::{Form, MaterialSpec, ShapeKind, ThingSpec};
use super::tracking::{AnchorTarget, Up};

/// Sizes beyond are mistakes of a unit, and leave the range in which f32 squares are exact enough.
const SIZES_M: std::ops::RangeInclusive<f64> = 1e-9..=1e6;

/// Errors and warnings, in no order.
pub(crate) fn problems(document: &Document<SessionSpec>) -> Vec<Problem> {
    let mut check = Check { document, problems: Vec::new(), tag_sizes: HashMap::new() };
    check.session(document.value());
    check.problems
}

struct Check<'a> {
    document: &'a Document<SessionSpec>,
    problems: Vec<Problem>,
    /// Sizes of tags where they were met first.
    tag_sizes: HashMap<(&'a str, u32), f64>,
}

impl<'a> Check<'a> {
    fn error(&mut self, at: &KeyPath, message: impl Into<String>, help: impl Into<String>) {
        self.problems.push(self.document.error_at(at, message, help));
    }

    fn warning(&mut self, at: &KeyPath, message: impl Into<String>, help: impl Into<String>) {
        self.problems.push(self.document.error_at(at, message, help).warning());
    }

    fn session(&mut self, spec: &'a SessionSpec) {
        self.sensors(spec);
        self.light_from_outside(spec);
        self.still_camera(spec);
        self.tracking(spec);
        self.names("thing", spec.things.iter().map(|thing| Some(thing.name.as_str())));
        self.names("light", spec.lights.iter().map(|light| light.name.as_deref()));
        for (index, thing) in spec.things.iter().enumerate() {
            self.thing(thing, &KeyPath::root().key("thing").index(index));
        }
        for (index, light) in spec.lights.iter().enumerate() {
            self.light(light, &KeyPath::root().key("light").index(index));
        }
    }

    fn sensors(&mut self, spec: &'a SessionSpec) {
        let mut opened: HashMap<String, &str> = HashMap::new();
        let sensors = [
            Some(("camera", &spec.camera.source, &spec.camera.calibration)),
            spec.fisheye.as_ref().map(|fisheye| ("fisheye", &fisheye.source, &fisheye.calibration)),
            spec.depth.as_ref().map(|depth| ("depth", &depth.source, &depth.calibration)),
        ];
        for (name, text, calibration) in sensors.into_iter().flatten() {
            let at = KeyPath::root().key(name);
            let source: SourceUri = match text.parse() {
                Ok(source) => source,
                Err(error) => {
                    self.error(&at.key("source"), error.to_string(), "");
                    continue;
                }
            };
            if source.scheme.is_device()
                && let Some(other) = opened.insert(text.clone(), name)
            {
                let message = format!("the device of [{other}]: it can only be opened once");
                self.error(&at.key("source"), message, "");
            }
            if calibration.is_none() && !source.scheme.brings_calibration() && name != "depth" {
                let help = format!("calibrate it and write calibration = \"{name}.toml\"");
                self.error(
                    &at.key("calibration"),
                    "missing key: this source brings no calibration along",
                    help,
                );
            }
        }
        let calibrations =
            (&spec.camera.calibration, spec.fisheye.as_ref().map(|fisheye| &fisheye.calibration));
        if let (Some(camera), Some(Some(fisheye))) = calibrations
            && camera == fisheye
        {
            let at = KeyPath::root().key("fisheye").key("calibration");
            self.warning(&at, "the calibration of [camera]: two cameras are never alike", "");
        }
    }

    fn still_camera(&mut self, spec: &'a SessionSpec) {
        let Some(pose) = &spec.camera.pose else {
            return;
        };
        let at = KeyPath::root().key("camera").key("pose");
        if pose.is_tracked() {
            self.error(&at.key("in"), "a camera that stands still is in the world", "write in = \"world\"");
        }
        if spec.tracking.is_some() {
            self.error(&at, "a camera that stands still beside [tracking]", "remove one of them");
        }
        self.camera_pose(pose, &at);
    }

    fn camera_pose(&mut self, pose: &'a PoseSpec, at: &KeyPath) {
        self.pose(pose, at);
        if pose.placement().scale.is_some() {
            self.error(&at.key("scale"), "a camera has no scale", "remove it");
        }
    }

    fn light_from_outside(&mut self, spec: &'a SessionSpec) {
        let root = KeyPath::root();
        if spec.environment.is_some() && spec.fisheye.is_some() {
            let help = "remove one of them";
            self.error(
                &root.key("environment"),
                "[environment] beside [fisheye]: both say where light comes from",
                help,
            );
        }
        if spec.environment.is_none() && spec.fisheye.is_none() && spec.lights.is_empty() {
            let help = "add [fisheye], [environment] or [[light]]";
            self.warning(&root, "there is no light: virtual things will be black", help);
        }
        if let Some(fisheye) = &spec.fisheye {
            self.fisheye(fisheye, spec);
            if let Some(room) = &fisheye.room {
                self.room(&room.form, &root.key("fisheye").key("room"));
            }
        }
        if let Some(room) = spec.environment.as_ref().and_then(|environment| environment.room.as_ref()) {
            self.room(&room.form, &root.key("environment").key("room"));
        }
    }

    fn fisheye(&mut self, fisheye: &'a FisheyeSpec, spec: &'a SessionSpec) {
        let at = KeyPath::root().key("fisheye");
        match (fisheye.mount, &fisheye.pose) {
            (Mount::Rig, Some(_)) => {
                let help = "remove it: the rig file says where the fish-eye is; or write mount = \"world\"";
                self.error(&at.key("pose"), "a pose beside mount = \"rig\"", help);
            }
            (Mount::Rig, None) if spec.rig.is_none() => {
                let help = "add rig = \"rig.toml\" at the top";
                self.error(&at.key("mount"), "mount = \"rig\" without a rig file", help);
            }
            (Mount::World, None) => {
                let help =
                    "give pose = { in = \"world\", … } or { in = \"marker\", … } for a tag on its housing";
                self.warning(
                    &at.key("mount"),
                    "no pose: taken to look straight up, image right along world x",
                    help,
                );
            }
            _ => {}
        }
        if let Some(pose) = &fisheye.pose {
            self.camera_pose(pose, &at.key("pose"));
        }
    }

    fn room(&mut self, form: &RoomForm, at: &KeyPath) {
        match form {
            RoomForm::Box(size_m) => self.sizes(size_m, &at.key("box")),
            RoomForm::Sphere(radius_m) => self.size(*radius_m, &at.key("sphere")),
        }
    }

    fn tracking(&mut self, spec: &'a SessionSpec) {
        let Some(tracking) = &spec.tracking else {
            return;
        };
        let at = KeyPath::root().key("tracking");
        if let AnchorTarget::Tag(tag) = &tracking.anchor.target {
            self.tag(tag, &at.key("anchor"));
        }
        if let Up::Pose(placement) = &tracking.anchor.up {
            self.placement(placement, &at.key("anchor").key("up"));
            if placement.scale.is_some() {
                self.error(&at.key("anchor").key("up").key("scale"), "an anchor has no scale", "remove it");
            }
        }
        for (index, tag) in tracking.tags.iter().enumerate() {
            self.tag(tag, &at.key("tags").index(index));
        }
    }

    fn names(&mut self, list: &str, names: impl Iterator<Item = Option<&'a str>>) {
        let mut first: HashMap<&str, usize> = HashMap::new();
        for (index, name) in names.enumerate() {
            let Some(name) = name else {
                continue;
            };
            if let Some(other) = first.get(name) {
                let message = format!("name given to {list}[{other}] already");
                self.error(
                    &KeyPath::root().key(list).index(index).key("name"),
                    message,
                    "names must be unique",
                );
            }
            first.entry(name).or_insert(index);
        }
    }

    fn thing(&mut self, thing: &'a ThingSpec, at: &KeyPath) {
        self.pose(&thing.pose, &at.key("pose"));
        match &thing.form {
            Form::Mesh(path) => {
                let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
                let known = ["glb", "gltf", "obj", "ply"];
                if !ending.as_deref().is_some_and(|ending| known.contains(&ending)) {
                    self.error(&at.key("mesh"), "unknown kind of mesh", "allowed: .glb, .gltf, .obj, .ply");
                }
            }
            Form::Shape(shape) => {
                self.shape(&shape.kind, &at.key("shape"));
                for (key, given) in
                    [("mesh_up", thing.mesh_up.is_some()), ("mesh_unit_m", thing.mesh_unit_m.is_some())]
                {
                    if given {
                        self.error(&at.key(key), "only for things with a mesh file", "remove it");
                    }
                }
            }
        }
        if let Some(material) = &thing.material {
            self.material(material, &at.key("material"));
        }
        if thing.hide_marker && !matches!(thing.pose, PoseSpec::Marker { .. }) {
            let help = "attach the thing with pose = { in = \"marker\", … }";
            self.error(&at.key("hide_marker"), "there is no marker to hide", help);
        }
    }

    fn shape(&mut self, kind: &ShapeKind, at: &KeyPath) {
        match kind {
            ShapeKind::Box(size_m) => self.sizes(size_m, &at.key("box")),
            ShapeKind::Sphere(radius_m) => self.size(*radius_m, &at.key("sphere")),
            ShapeKind::Plane(size_m) => self.sizes(size_m, &at.key("plane")),
            ShapeKind::Teapot(height_m) => self.size(*height_m, &at.key("teapot")),
            ShapeKind::Ring(ring) => {
                let at = at.key("ring");
                self.size(ring.inner_radius_m, &at.key("inner_radius_m"));
                self.size(ring.outer_radius_m, &at.key("outer_radius_m"));
                self.size(ring.height_m, &at.key("height_m"));
                let wall_m = ring.outer_radius_m - ring.inner_radius_m;
                if wall_m <= 0.0 {
                    let message = format!("not larger than inner_radius_m = {}", ring.inner_radius_m);
                    self.error(&at.key("outer_radius_m"), message, "");
                } else if ring.bevel_m > wall_m.min(ring.height_m) / 2.0 {
                    let most = wall_m.min(ring.height_m) / 2.0;
                    self.error(
                        &at.key("bevel_m"),
                        "more than half the wall or height",
                        format!("at most {most}"),
                    );
                }
            }
        }
    }

    fn sizes(&mut self, sizes_m: &[f64], at: &KeyPath) {
        for (index, size_m) in sizes_m.iter().enumerate() {
            self.size(*size_m, &at.index(index));
        }
    }

    fn size(&mut self, size_m: f64, at: &KeyPath) {
        if !SIZES_M.contains(&size_m) {
            let message = format!("{size_m} is no length");
            self.error(at, message, "allowed: from 1e-9 to 1e6 metres");
        }
    }

    fn material(&mut self, material: &MaterialSpec, at: &KeyPath) {
        if material.phong_exponent.is_some() && material.roughness.is_some() {
            self.error(
                &at.key("phong_exponent"),
                "`phong_exponent` beside `roughness`: both say how dull it is",
                "",
            );
        }
        if material.eta.is_some() != material.k.is_some() {
            let (given, other) = if material.eta.is_some() { ("eta", "k") } else { ("k", "eta") };
            self.error(&at.key(given), format!("`{given}` without `{other}`"), "");
        }
        if material.eta.is_some() && material.base_color.is_some() {
            self.error(&at.key("eta"), "`eta` beside `base_color`: both say the metal's colour", "");
        }
        if material.attenuation_color.is_some() != material.attenuation_distance_m.is_some() {
            let given = if material.attenuation_color.is_some() {
                "attenuation_color"
            } else {
                "attenuation_distance_m"
            };
            let help = "attenuation_color is the colour left after attenuation_distance_m";
            self.error(&at.key(given), "one of two keys that only mean something together", help);
        }
    }

    fn light(&mut self, light: &'a LightSpec, at: &KeyPath) {
        self.pose(&light.pose, &at.key("pose"));
        let (strength, given) = match &light.kind {
            LightKindSpec::Spot { radiant_intensity, cone_deg: [inner, outer], radius_m } => {
                if inner > outer {
                    let message = format!("inner angle {inner} is larger than outer angle {outer}");
                    self.error(&at.key("cone_deg"), message, "write [inner, outer]");
                } else if *outer == 0.0 {
                    self.error(&at.key("cone_deg"), "a cone without opening", "");
                }
                self.size(*radius_m, &at.key("radius_m"));
                ("radiant_intensity", radiant_intensity.is_some())
            }
            LightKindSpec::Area { size_m, radiance } => {
                self.sizes(size_m, &at.key("size_m"));
                ("radiance", radiance.is_some())
            }
        };
        match (given, light.fit) {
            (false, false) => {
                let help = "or fit = true, to measure a real light";
                self.error(&at.key(strength), "missing key: how strong the light is", help);
            }
            (true, true) => {
                self.error(&at.key("fit"), format!("fit = true beside `{strength}`"), "remove one of them")
            }
            _ => {}
        }
        if light.fit && !light.world.is_real() {
            self.error(&at.key("fit"), "a virtual light cannot be measured", format!("give `{strength}`"));
        }
    }

    fn pose(&mut self, pose: &'a PoseSpec, at: &KeyPath) {
        if let PoseSpec::Marker { tag, .. } = pose {
            self.tag(tag, at);
        }
        if pose.is_tracked() && self.document.value().tracking.is_none() {
            let help = "add [tracking] with anchor = { board = \"board.toml\" }";
            self.error(&at.key("in"), "attached to something tracked, but there is no [tracking]", help);
        }
        self.placement(pose.placement(), at);
    }

    fn placement(&mut self, placement: &Placement, at: &KeyPath) {
        if let Err(error) = placement.rotation() {
            self.error(&at.key(error.key()), error.to_string(), "");
        }
        if placement.scale.is_some_and(|scale| !(1e-9..=1e9).contains(&scale)) {
            self.error(&at.key("scale"), "out of range", "allowed: from 1e-9 to 1e9");
        }
        for (index, position_m) in placement.position_m.iter().enumerate() {
            if position_m.abs() > *SIZES_M.end() {
                self.error(&at.key("position_m").index(index), "farther than 1e6 metres away", "");
            }
        }
    }

    fn tag(&mut self, tag: &'a Tag, at: &KeyPath) {
        match tags_of(&tag.family) {
            None => {
                let names: Vec<&str> = FAMILIES.iter().map(|&(name, _)| name).collect();
                let help = match coshade_config::nearest(&tag.family, names.iter().copied()) {
                    Some(name) => format!("did you mean `{name}`?"),
                    None => format!("known: {}", names.join(", ")),
                };
                self.error(&at.key("family"), format!("unknown tag family `{}`", tag.family), help);
            }
            Some(count) if tag.id >= count => {
                let message = format!("{} has no tag {}", tag.family, tag.id);
                self.error(&at.key("id"), message, format!("allowed: from 0 to {}", count - 1));
            }
            Some(_) => {}
        }
        self.size(tag.size_m, &at.key("size_m"));
        let first_m = *self.tag_sizes.entry((&tag.family, tag.id)).or_insert(tag.size_m);
        if first_m != tag.size_m {
            let message = format!("tag {} of {} is {first_m} m elsewhere in this file", tag.id, tag.family);
            self.error(&at.key("size_m"), message, "one tag has one size");
        }
    }
}

/// Devices are not files on every system, and `images:` takes patterns.
pub(crate) fn source_file(source: &SourceUri) -> Option<&str> {
    match source.scheme {
        SourceScheme::V4l | SourceScheme::Replay | SourceScheme::Sim => Some(&source.path),
        SourceScheme::Images if !source.path.contains(['*', '?', '[']) => Some(&source.path),
        SourceScheme::Images | SourceScheme::Nokhwa => None,
    }
}
