//! What in a world contradicts itself.

use std::collections::HashSet;

use coshade_capture::PixelFormat;
use coshade_config::{Document, KeyPath, Problem};
use coshade_scene::session::family::{FAMILIES, tags_of};
use coshade_scene::session::placement::Placement;

use super::spec::{SensorSpec, WorldSpec};
use super::{keyframes, scene};
use crate::path::{Path, PathError};
use crate::sensor::FormatSpec;

/// Errors, in no order.
pub(super) fn problems(document: &Document<WorldSpec>) -> Vec<Problem> {
    let mut check = Check { document, problems: Vec::new() };
    check.world(document.value());
    check.problems.extend(scene::problems(document));
    check.problems
}

struct Check<'a> {
    document: &'a Document<WorldSpec>,
    problems: Vec<Problem>,
}

impl Check<'_> {
    fn error(&mut self, at: &KeyPath, message: impl Into<String>, help: impl Into<String>) {
        self.problems.push(self.document.error_at(at, message, help));
    }

    fn world(&mut self, spec: &WorldSpec) {
        let root = KeyPath::root();
        if spec.sensors.is_empty() {
            self.error(&root.key("sensor"), "no sensors", "add [sensor.camera]");
        }
        for (name, sensor) in &spec.sensors {
            self.sensor(name, sensor, &root.key("sensor").key(name));
        }
        let mut seen = HashSet::new();
        for (index, tag) in spec.tags.iter().enumerate() {
            let at = root.key("tag").index(index);
            self.tag(&tag.tag.family, tag.tag.id, &at);
            if !(1e-6..=1e3).contains(&tag.tag.size_m) {
                self.error(&at.key("size_m"), "no size of a print", "allowed: from 1e-6 to 1000 metres");
            }
            if !seen.insert((tag.tag.family.as_str(), tag.tag.id)) {
                self.error(&at.key("id"), "this tag is there already", "every tag is there once");
            }
            self.rigid(&tag.pose, &at.key("pose"));
        }
        for (index, board) in spec.boards.iter().enumerate() {
            self.rigid(&board.pose, &root.key("board").index(index).key("pose"));
        }
        self.path(spec);
    }

    fn tag(&mut self, family: &str, id: u32, at: &KeyPath) {
        match tags_of(family) {
            None => {
                let names = FAMILIES.map(|(name, _)| name);
                let help = match coshade_config::nearest(family, names) {
                    Some(name) => format!("did you mean `{name}`?"),
                    None => format!("known: {}", names.join(", ")),
                };
                self.error(&at.key("family"), format!("unknown tag family `{family}`"), help);
            }
            Some(count) if id >= count => {
                self.error(
                    &at.key("id"),
                    format!("{family} has no tag {id}"),
                    format!("allowed: from 0 to {}", count - 1),
                );
            }
            Some(_) => {}
        }
    }

    fn rigid(&mut self, placement: &Placement, at: &KeyPath) {
        if let Err(error) = placement.rotation() {
            self.error(&at.key(error.key()), error.to_string(), "");
        }
        if placement.scale.is_some() {
            self.error(&at.key("scale"), "sensors and prints have no scale", "remove it");
        }
        if placement.position_m.iter().any(|coordinate| coordinate.abs() > 1e6) {
            self.error(&at.key("position_m"), "farther than 1e6 metres away", "");
        }
    }

    fn sensor(&mut self, name: &str, sensor: &SensorSpec, at: &KeyPath) {
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
        if name.is_empty() || name.len() > 100 || !plain {
            self.error(at, "unusable name", "use 1 to 100 letters, digits, '_' and '-'");
        }
        self.rigid(&sensor.pose, &at.key("pose"));
        match (&sensor.calibration, sensor.size_px, sensor.fov_deg) {
            (Some(_), None, None) | (None, Some(_), Some(_)) => {}
            (Some(_), ..) => {
                let help = "remove size_px and fov_deg, or calibration";
                self.error(&at.key("calibration"), "`calibration` beside `size_px` or `fov_deg`", help);
            }
            (None, ..) => {
                self.error(
                    at,
                    "neither `calibration` nor both `size_px` and `fov_deg`",
                    "the sensor needs a lens",
                );
            }
        }
        if sensor.depth.is_some() && sensor.format != FormatSpec::Z16 {
            self.error(&at.key("depth"), "only for depth cameras", "write format = \"z16\", or remove it");
        }
        if let Some(depth) = &sensor.depth
            && depth.range_m[0] >= depth.range_m[1]
        {
            self.error(&at.key("depth").key("range_m"), "an empty range", "write [nearest, farthest]");
        }
        if let Some(size_px) = sensor.size_px
            && let Some(message) = odd_size(sensor.format, size_px)
        {
            self.error(&at.key("size_px"), message, "");
        }
    }

    fn path(&mut self, spec: &WorldSpec) {
        let at = KeyPath::root().key("keyframe");
        let mut usable = Vec::new();
        for (index, keyframe) in spec.keyframes.iter().enumerate() {
            match keyframes::keyframe(keyframe) {
                Ok(keyframe) => usable.push(keyframe),
                Err((key, message)) => self.error(&at.index(index).key(key), message, ""),
            }
        }
        if usable.len() < spec.keyframes.len() || usable.is_empty() {
            return;
        }
        match Path::new(&usable) {
            Err(error @ PathError::Order { index, .. }) => {
                self.error(&at.index(index).key("time_s"), error.to_string(), "");
            }
            Err(error @ PathError::Turn { index, .. }) => self.error(&at.index(index), error.to_string(), ""),
            Err(error) => self.error(&at, error.to_string(), ""),
            Ok(_) => {}
        }
    }
}

/// What is wrong with the size of an image of a format.
pub(super) fn odd_size(format: FormatSpec, [width, height]: [u32; 2]) -> Option<String> {
    match format.pixel_format() {
        PixelFormat::Yuyv | PixelFormat::Uyvy if width % 2 == 1 => {
            Some("the width must be even for 4:2:2".into())
        }
        PixelFormat::Nv12 if (width | height) % 2 == 1 => {
            Some("width and height must be even for 4:2:0".into())
        }
        _ => None,
    }
}
