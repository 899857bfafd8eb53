//! Whether the files are there that a session names.

use std::path::Path;

use coshade_config::{KeyPath, Problem};
use coshade_tracker::Board;

use super::Session;
use super::check_content::source_file;
use super::placement::PoseSpec;
use super::sensors::Mount;
use super::source::{SourceScheme, SourceUri};
use super::thing::Form;
use super::tracking::AnchorTarget;
use crate::rig::Rig;

/// Errors and warnings, in no order.
pub(crate) fn problems(session: &Session) -> Vec<Problem> {
    let mut check = Check { session, problems: Vec::new() };
    check.all();
    check.problems
}

struct Check<'a> {
    session: &'a Session,
    problems: Vec<Problem>,
}

impl Check<'_> {
    fn error(&mut self, at: &KeyPath, message: impl Into<String>, help: impl Into<String>) {
        self.problems.push(self.session.document.error_at(at, message, help));
    }

    fn all(&mut self) {
        let spec = self.session.spec();
        let root = KeyPath::root();
        self.sensor("camera", &spec.camera.source, spec.camera.calibration.as_deref());
        if let Some(fisheye) = &spec.fisheye {
            self.sensor("fisheye", &fisheye.source, fisheye.calibration.as_deref());
            if let Some(pose) = &fisheye.pose {
                self.pose(pose, &root.key("fisheye").key("pose"));
            }
        }
        if let Some(depth) = &spec.depth {
            self.sensor("depth", &depth.source, depth.calibration.as_deref());
        }
        if let Some(rig) = &spec.rig {
            self.rig(rig);
        }
        if let Some(environment) = &spec.environment {
            self.file(&environment.file, &root.key("environment").key("file"));
        }
        if let Some(AnchorTarget::Board { board }) =
            spec.tracking.as_ref().map(|tracking| &tracking.anchor.target)
        {
            self.board(board, &root.key("tracking").key("anchor").key("board"));
        }
        for (index, thing) in spec.things.iter().enumerate() {
            let at = root.key("thing").index(index);
            if let Form::Mesh(mesh) = &thing.form {
                self.file(mesh, &at.key("mesh"));
            }
            self.pose(&thing.pose, &at.key("pose"));
        }
        for (index, light) in spec.lights.iter().enumerate() {
            self.pose(&light.pose, &root.key("light").index(index).key("pose"));
        }
    }

    fn sensor(&mut self, name: &str, source: &str, calibration: Option<&Path>) {
        let at = KeyPath::root().key(name);
        if let Ok(source) = source.parse() {
            self.source(&source, &at.key("source"));
        }
        if let Some(calibration) = calibration {
            let at = at.key("calibration");
            if self.file(calibration, &at)
                && let Err(error) =
                    coshade_lens::calibration::Calibration::read(self.session.resolve(calibration))
            {
                self.error(&at, format!("not a calibration: {error}"), "");
            }
        }
    }

    fn source(&mut self, source: &SourceUri, at: &KeyPath) {
        let Some(path) = source_file(source) else {
            return;
        };
        let path = self.session.resolve(path);
        if !path.exists() {
            let message = format!("{} does not exist", path.display());
            match source.scheme {
                // It may be plugged in later.
                SourceScheme::V4l => {
                    let problem = self.session.document.error_at(
                        at,
                        message,
                        "plug the camera in, or see `coshade list`",
                    );
                    self.problems.push(problem.warning());
                }
                _ => self.error(at, message, "paths are relative to the session file"),
            }
        }
    }

    /// True if it is there.
    fn file(&mut self, path: &Path, at: &KeyPath) -> bool {
        let full = self.session.resolve(path);
        let message = match std::fs::metadata(&full) {
            Ok(metadata) if metadata.is_file() => return true,
            Ok(_) => format!("{} is not a file", full.display()),
            Err(error) => format!("{}: {error}", full.display()),
        };
        self.error(at, message, "paths are relative to the session file");
        false
    }

    fn rig(&mut self, path: &Path) {
        let at = KeyPath::root().key("rig");
        if !self.file(path, &at) {
            return;
        }
        let rig = match Rig::read(self.session.resolve(path)) {
            Ok(rig) => rig,
            Err(error) => return self.error(&at, format!("not a rig: {error}"), ""),
        };
        let on_rig = self.session.spec().fisheye.as_ref().is_some_and(|fisheye| fisheye.mount == Mount::Rig);
        let needed = if on_rig { ["camera", "fisheye"].as_slice() } else { &[] };
        for name in needed.iter().filter(|name| !rig.sensors.contains_key(**name)) {
            let help = format!("add [sensor.{name}] to it, or write mount = \"world\"");
            self.error(&at, format!("the rig has no sensor `{name}`"), help);
        }
    }

    fn board(&mut self, path: &Path, at: &KeyPath) {
        if self.file(path, at)
            && let Err(error) = Board::read(self.session.resolve(path))
        {
            self.error(at, format!("not a board: {error}"), "");
        }
    }

    fn pose(&mut self, pose: &PoseSpec, at: &KeyPath) {
        match pose {
            PoseSpec::Body { body, .. } => self.board(body, &at.key("body")),
            PoseSpec::Board { board, .. } => self.board(board, &at.key("board")),
            PoseSpec::World { .. } | PoseSpec::Marker { .. } => {}
        }
    }
}
