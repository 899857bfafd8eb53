//! What is looked at, and what for: a session, or a source and what is named beside it.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, anyhow, bail};
use coshade_capture::{Camera, PixelFormat};
use coshade_lens::calibration::Calibration;
use coshade_scene::session::Session;
use coshade_scene::session::source::{SourceScheme, SourceUri};
use coshade_tracker::TagId;

use super::bodies::Bodies;
use crate::command::info::kind::{self, Kind};
use crate::pipeline::Source;
use crate::sources;

/// A camera, its lens, and bodies to find.
pub struct Input {
    /// The session or source as named.
    pub name: String,
    /// The camera, opened.
    pub source: Source,
    /// For the size of its frames.
    pub calibration: Calibration,
    /// What to find.
    pub bodies: Bodies,
    /// Whether the session wants poses filtered.
    pub filter: bool,
}

/// What an argument may say beside a source.
pub struct Beside<'a> {
    /// `--calibration`
    pub calibration: Option<&'a Path>,
    /// `--board`
    pub boards: &'a [PathBuf],
    /// `--tag`
    pub tags: &'a [(TagId, f64)],
    /// `--live`
    pub live: bool,
}

impl Input {
    /// Opens what `name` says.
    ///
    /// # Errors
    /// Name the file and key, or the argument, that is missing or wrong.
    pub fn open(name: &str, beside: &Beside<'_>) -> anyhow::Result<Self> {
        let registry = sources::registry();
        let is_source = name
            .split_once(':')
            .is_some_and(|(scheme, _)| registry.schemes().any(|(known, _)| known == scheme));
        if is_source && !Path::new(name).exists() {
            return Self::of_source(name, beside);
        }
        if beside.calibration.is_some() || !beside.boards.is_empty() || !beside.tags.is_empty() {
            bail!("{name}: --calibration, --board and --tag go with a source; a session says these itself");
        }
        match kind::of(Path::new(name))? {
            Kind::Session => Self::of_session(Path::new(name), beside.live),
            Kind::Recording => {
                bail!("{name} is a recording: name one of its streams, such as replay:{name}#camera")
            }
            Kind::World => bail!("{name} is a world: name one of its sensors, such as sim:{name}#camera"),
            Kind::Folder => bail!("{name} is a folder: name its images, such as images:{name}/*.png"),
            Kind::Image => bail!("{name} is an image: name it as a source, images:{name}"),
            other => bail!("{name}: a {} is nothing to track; give a session or a source", other.name()),
        }
    }

    fn of_session(path: &Path, live: bool) -> anyhow::Result<Self> {
        let session = Session::read(path)?;
        let spec = session.spec();
        if spec.camera.pose.is_some() {
            bail!(
                "{}: the camera stands still ([camera] pose), so nothing is tracked; remove that key to track it",
                path.display()
            );
        }
        let bodies = Bodies::of_session(&session)?;
        let sensor = sources::sensors(&session)?.into_iter().find(|sensor| sensor.name == "camera");
        let sensor = sensor.ok_or_else(|| anyhow!("{}: no [camera]", path.display()))?;
        let source =
            open(&sensor.source, live).with_context(|| format!("{}: camera.source", path.display()))?;
        let calibration =
            lens(source.camera.as_ref(), sensor.calibration.as_deref(), "[camera] calibration")?;
        let filter = spec.tracking.as_ref().is_none_or(|tracking| tracking.filter);
        Ok(Self { name: path.display().to_string(), source, calibration, bodies, filter })
    }

    fn of_source(name: &str, beside: &Beside<'_>) -> anyhow::Result<Self> {
        let bodies = Bodies::of_arguments(beside.boards, beside.tags)?;
        let source = open(name, beside.live)?;
        let calibration = lens(source.camera.as_ref(), beside.calibration, "--calibration camera.toml")?;
        Ok(Self { name: name.to_owned(), source, calibration, bodies, filter: true })
    }
}

/// Opens a source that shows colours or brightness.
///
/// # Errors
/// Of the source; a depth camera.
pub fn open(uri: &str, live: bool) -> anyhow::Result<Source> {
    let registry = sources::registry();
    let uri = if live { uri.to_owned() } else { at_full_speed(uri.parse()?).to_string() };
    let camera = registry.open(&uri)?;
    if camera.stream().format == PixelFormat::Z16 {
        bail!("{}: is a depth camera, which cannot see tags", camera.name());
    }
    Ok(Source { camera, open: Box::new(move || registry.open(&uri)) })
}

/// A file need not come at the pace it was recorded at, unless that is asked for.
fn at_full_speed(mut uri: SourceUri) -> SourceUri {
    let (key, option) = match uri.scheme {
        SourceScheme::Replay => ("rate=", "rate=max"),
        SourceScheme::Images | SourceScheme::Sim => ("pace=", "pace=fast"),
        SourceScheme::V4l | SourceScheme::Nokhwa => return uri,
    };
    let query = uri.query.take().unwrap_or_default();
    let mut options: Vec<&str> = query.split('&').filter(|option| !option.is_empty()).collect();
    if !options.iter().any(|stated| stated.starts_with(key)) {
        options.push(option);
    }
    uri.query = Some(options.join("&"));
    uri
}

/// The calibration file for a camera, else the one that it brings along.
pub fn lens(camera: &dyn Camera, file: Option<&Path>, how: &str) -> anyhow::Result<Calibration> {
    match (file, camera.calibration()) {
        (Some(file), _) => sources::calibration_for(camera, file),
        (None, Some(own)) => Ok(own.clone()),
        (None, None) => {
            bail!("{}: its lens is not known, and poses need it: give {how}", camera.name())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_not_waited_for_unless_they_say_so() {
        let fast = |uri: &str| at_full_speed(uri.parse().unwrap()).to_string();
        assert_eq!(fast("replay:a.mcap#camera"), "replay:a.mcap#camera?rate=max");
        assert_eq!(fast("replay:a.mcap?start_s=2"), "replay:a.mcap?start_s=2&rate=max");
        assert_eq!(fast("replay:a.mcap?rate=2"), "replay:a.mcap?rate=2");
        assert_eq!(fast("images:img?.png"), "images:img?.png?pace=fast");
        assert_eq!(fast("sim:a.toml#camera?pace=realtime"), "sim:a.toml#camera?pace=realtime");
        assert_eq!(fast("v4l:/dev/video0"), "v4l:/dev/video0");
    }
}
