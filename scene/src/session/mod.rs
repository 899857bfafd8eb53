//! The session file: one TOML file that describes a session. `docs/session.md` lists its keys.
//!
//! | module | keys |
//! | --- | --- |
//! | [`sensors`] | `[camera]`, `[fisheye]`, `[environment]`, `[depth]` |
//! | [`source`] | what `source = "…"` may be |
//! | [`tracking`], [`family`] | `[tracking]`, tag families |
//! | [`thing`], [`light`] | `[[thing]]`, `[[light]]` |
//! | [`placement`] | `pose = { … }` |
//! | [`render`] | `[render]` |
//!
//! [`Session::read`] refuses a file that contradicts itself. Whether the files exist that it names is asked apart, by
//! [`Session::check`]. [`Session::assemble`] makes a [`crate::Scene`] of it.

mod assemble;
mod check_content;
mod check_files;
mod convert;
pub mod family;
pub mod light;
pub mod placement;
pub mod render;
pub mod sensors;
pub mod source;
pub mod thing;
pub mod tracking;

use std::path::{Path, PathBuf};

use coshade_config::{Document, Error, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use assemble::{AssembleError, Assembled};
pub use convert::PlacementError;
pub(crate) use convert::unit_quaternion;
use light::LightSpec;
use render::RenderSpec;
use sensors::{CameraSpec, DepthSpec, EnvironmentSpec, FisheyeSpec};
use thing::ThingSpec;
use tracking::TrackingSpec;

/// One session: its cameras, its light, what stands in the room and what is drawn into it. Every path is relative to
/// this file. Metres; +Z is up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SessionSpec {
    /// Version of this format.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Rig file: where the cameras sit to each other. Needed for a fish-eye with `mount = "rig"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<PathBuf>,
    /// The see-through camera.
    pub camera: CameraSpec,
    /// The fish-eye camera that sees the light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fisheye: Option<FisheyeSpec>,
    /// An image of the light instead of a fish-eye.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentSpec>,
    /// The depth camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<DepthSpec>,
    /// What the tracker holds on to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracking: Option<TrackingSpec>,
    /// Things, real and virtual.
    #[serde(default, rename = "thing", skip_serializing_if = "Vec::is_empty")]
    pub things: Vec<ThingSpec>,
    /// Described lights, real and virtual.
    #[serde(default, rename = "light", skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<LightSpec>,
    /// How the composite is made.
    #[serde(default)]
    pub render: RenderSpec,
}

/// A session file: what it says, and where it says it.
#[derive(Clone, Debug)]
pub struct Session {
    document: Document<SessionSpec>,
}

impl Session {
    /// Reads a session.
    ///
    /// # Errors
    /// [`Error::Invalid`] with all problems at once, each with file, line, column and key; other variants if the file
    /// cannot be read.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::read(path)?)
    }

    /// As [`Session::read`] from a text; `path` is where the text came from.
    ///
    /// # Errors
    /// As [`Session::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::parse(text, path)?)
    }

    /// A new session file; nothing is written before [`Session::save`].
    ///
    /// # Errors
    /// [`Error::Unwritable`] for values such as NaN, [`Error::Invalid`] if it contradicts itself.
    pub fn new(spec: &SessionSpec, path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::new(spec, path)?)
    }

    fn consistent(document: Document<SessionSpec>) -> Result<Self, Error> {
        Document::<SessionSpec>::reject(check_content::problems(&document))?;
        Ok(Self { document })
    }

    /// What the file says.
    pub fn spec(&self) -> &SessionSpec {
        self.document.value()
    }

    /// The file.
    pub fn path(&self) -> PathBuf {
        self.document.path()
    }

    /// A path of the file's, from where the program runs.
    pub fn resolve(&self, path: impl AsRef<Path>) -> PathBuf {
        match self.path().parent() {
            Some(folder) => folder.join(path),
            None => path.as_ref().to_path_buf(),
        }
    }

    /// All that keeps the session from running or looks wrong: files that are missing or unreadable, doubtful values. In
    /// the order of the file; empty if all is well.
    pub fn check(&self) -> Vec<Problem> {
        let mut problems = check_content::problems(&self.document);
        problems.extend(check_files::problems(self));
        problems.sort_by_key(|problem| (problem.line, problem.column));
        problems
    }

    /// Takes over changed values; comments and formatting of the rest of the file stay. See [`Document::set`].
    ///
    /// # Errors
    /// As [`Session::new`]; the session is then as before.
    pub fn set(&mut self, spec: &SessionSpec) -> Result<(), Error> {
        let mut changed = self.document.clone();
        changed.set(spec)?;
        *self = Self::consistent(changed)?;
        Ok(())
    }

    /// Writes the file it was read from, whole or not at all.
    ///
    /// # Errors
    /// [`Error::ChangedOnDisk`] if another program wrote it since, [`Error::Write`].
    pub fn save(&mut self) -> Result<(), Error> {
        self.document.save()
    }

    /// The text of the file.
    pub fn text(&self) -> &str {
        self.document.text()
    }
}
