//! Where images come from: a session's camera, or a source.

use std::path::Path;

use anyhow::{Context as _, anyhow, bail};
use coshade_lens::calibration::Calibration;
use coshade_scene::session::Session;

use crate::command::info::kind::{self, Kind};
use crate::command::track::input::{lens, open};
use crate::pipeline::Source;
use crate::sources;

/// A camera and its lens.
pub struct Input {
    /// The session or source as named.
    pub name: String,
    /// The camera, opened.
    pub source: Source,
    /// For the size of its images.
    pub calibration: Calibration,
}

impl Input {
    /// Opens what `name` says.
    ///
    /// # Errors
    /// Name the file and key, or the argument, that is missing or wrong.
    pub fn open(name: &str, calibration: Option<&Path>) -> anyhow::Result<Self> {
        let registry = sources::registry();
        let scheme = name.split_once(':').map(|(scheme, _)| scheme);
        let is_source = scheme.is_some_and(|scheme| registry.schemes().any(|(known, _)| known == scheme));
        if is_source && !Path::new(name).exists() {
            let source = open(name, false)?;
            let calibration = lens(source.camera.as_ref(), calibration, "--calibration camera.toml")?;
            return Ok(Self { name: name.to_owned(), source, calibration });
        }
        match kind::of(Path::new(name))? {
            Kind::Session => Self::of_session(Path::new(name), calibration),
            Kind::Recording => {
                bail!("{name} is a recording: name one of its streams, such as replay:{name}#camera")
            }
            Kind::World => bail!("{name} is a world: name one of its sensors, such as sim:{name}#camera"),
            Kind::Folder => bail!("{name} is a folder: name its images, such as images:{name}/*.png"),
            Kind::Image => bail!("{name} is an image: name several as a source, such as images:photos/*.png"),
            other => bail!("{name}: a {} shows no tags; give a session or a source", other.name()),
        }
    }

    fn of_session(path: &Path, calibration: Option<&Path>) -> anyhow::Result<Self> {
        let name = path.display().to_string();
        if calibration.is_some() {
            bail!("{name}: --calibration goes with a source; a session says it itself");
        }
        let session = Session::read(path)?;
        let sensor = sources::sensors(&session)?.into_iter().find(|sensor| sensor.name == "camera");
        let sensor = sensor.ok_or_else(|| anyhow!("{name}: no [camera]"))?;
        let source = open(&sensor.source, false).with_context(|| format!("{name}: camera.source"))?;
        let calibration =
            lens(source.camera.as_ref(), sensor.calibration.as_deref(), "[camera] calibration")?;
        Ok(Self { name, source, calibration })
    }
}
