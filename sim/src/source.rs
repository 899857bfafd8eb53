//! `sim:`: a sensor of a simulated world as a camera.
//!
//! `sim:WORLD.toml#SENSOR?pace=realtime&cache=FOLDER`. Options:
//!
//! | option | meaning |
//! | --- | --- |
//! | `pace=realtime` | or `fast`: as fast as frames are asked for, with the same stamps |
//! | `cache=FOLDER` | where pictures are kept; left out, the user's cache folder |
//!
//! Pictures that are not in the cache are traced when the source is opened, which may take long.

use std::sync::Arc;

use coshade_capture::{Camera, CaptureError, SourceRegistry};
use coshade_scene::session::source::SourceUri;

use crate::cache::PictureCache;
use crate::camera::{Pace, SimCamera};
use crate::device::Progress;
use crate::world::World;

/// Adds the scheme `sim` to a registry.
pub fn register(registry: &mut SourceRegistry) {
    registry.register("sim", "sim:desk.toml#camera", Box::new(open));
}

/// Opens what follows `sim:` in the name of a source; how far tracing is goes to the log.
///
/// # Errors
/// [`CaptureError::Lost`] that says which file, key or option is wrong.
pub fn open(rest: &str) -> Result<Box<dyn Camera>, CaptureError> {
    let mut told = 0;
    let camera = open_with(rest, |progress| {
        let tenth = progress.done * 10 / progress.total.max(1);
        if tenth > told {
            told = tenth;
            tracing::info!("sim:{rest}: {} of {} pictures", progress.done, progress.total);
        }
        true
    })?;
    Ok(Box::new(camera))
}

/// As [`open`], with the progress of tracing; `progress` returns false to give up.
///
/// # Errors
/// As [`open`].
pub fn open_with(rest: &str, progress: impl FnMut(Progress) -> bool) -> Result<SimCamera, CaptureError> {
    let name = format!("sim:{rest}");
    let lost = |reason: String| CaptureError::Lost { source_name: name.clone(), reason };
    let uri: SourceUri = name.parse().map_err(|error| lost(format!("{error}")))?;
    let (pace, cache) = options(uri.query.as_deref().unwrap_or_default()).map_err(lost)?;
    let world = World::read(&uri.path).map_err(|error| lost(error.to_string()))?;
    // Asked for before the scene is read: a wrong name is told at once.
    let sensor_name = uri.fragment.unwrap_or_default();
    world.calibration(&sensor_name).map_err(|error| lost(error.to_string()))?;
    let tracer = world.tracer().map_err(|error| lost(error.to_string()))?;
    let sensor = world.sensor(&sensor_name, Arc::new(tracer)).map_err(|error| lost(error.to_string()))?;
    let sensor = sensor.with_cache(cache);
    if !sensor.prepare(progress) {
        return Err(lost("stopped while its pictures were made".into()));
    }
    Ok(SimCamera::new(name.clone(), sensor, pace))
}

fn options(query: &str) -> Result<(Pace, Option<PictureCache>), String> {
    let (mut pace, mut cache) = (Pace::default(), PictureCache::of_user());
    for option in query.split('&').filter(|option| !option.is_empty()) {
        match option.split_once('=') {
            Some(("pace", "realtime")) => pace = Pace::RealTime,
            Some(("pace", "fast")) => pace = Pace::Fast,
            Some(("pace", other)) => return Err(format!("pace={other}: allowed are realtime and fast")),
            Some(("cache", folder)) if !folder.is_empty() => cache = Some(PictureCache::new(folder)),
            _ => {
                return Err(format!(
                    "unknown option `{option}`: allowed are pace=realtime|fast and cache=FOLDER"
                ));
            }
        }
    }
    Ok((pace, cache))
}
