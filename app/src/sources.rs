//! The kinds of source that this binary can open, and the sensors of a session.

use std::path::{Path, PathBuf};

use anyhow::Context;
use coshade_capture::{Camera, SourceRegistry};
use coshade_lens::calibration::Calibration;
use coshade_scene::session::Session;
use coshade_scene::session::source::SourceUri;

/// Every scheme of every crate.
pub fn registry() -> SourceRegistry {
    let mut registry = SourceRegistry::builtin();
    coshade_sim::source::register(&mut registry);
    registry
}

/// A sensor that a session names, with paths as this process sees them.
pub struct Sensor {
    /// `camera`, `fisheye` or `depth`.
    pub name: &'static str,
    /// What to open.
    pub source: String,
    /// Its calibration file, if the session names one.
    pub calibration: Option<PathBuf>,
}

/// The sensors of a session.
pub fn sensors(session: &Session) -> anyhow::Result<Vec<Sensor>> {
    let spec = session.spec();
    let mut named = vec![("camera", &spec.camera.source, &spec.camera.calibration)];
    named.extend(spec.fisheye.as_ref().map(|fisheye| ("fisheye", &fisheye.source, &fisheye.calibration)));
    named.extend(spec.depth.as_ref().map(|depth| ("depth", &depth.source, &depth.calibration)));
    named
        .into_iter()
        .map(|(name, source, calibration)| {
            let mut uri: SourceUri = source.parse()?;
            if !uri.scheme.is_device() {
                uri.path = session.resolve(&uri.path).display().to_string();
            }
            let calibration = calibration.as_ref().map(|file| session.resolve(file));
            Ok(Sensor { name, source: uri.to_string(), calibration })
        })
        .collect()
}

/// Reads a calibration and brings it to the size that the camera delivers, whose format must have its response.
pub fn calibration_for(camera: &dyn Camera, file: &Path) -> anyhow::Result<Calibration> {
    let stream = camera.stream();
    let unfit = || format!("{} does not fit {}", file.display(), camera.name());
    let calibration = Calibration::read(file)?;
    stream.format.check_response(&calibration.response).with_context(unfit)?;
    let (scaled, warning) = calibration.scaled_to([stream.width_px, stream.height_px]).with_context(unfit)?;
    if let Some(warning) = warning {
        tracing::warn!("{}: {warning}", file.display());
    }
    Ok(scaled)
}
