//! What the path tracer is to make a picture of: a session whose camera stands still, or a sensor of a described world.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, anyhow, bail};
use coshade_lens::calibration::Calibration;
use coshade_reference::camera::Camera;
use coshade_reference::emitter::{Environment, EnvironmentFile};
use coshade_reference::integrator::TraceScene;
use coshade_scene::Scene;
use coshade_scene::session::Session;
use coshade_sim::world::World;

use super::info::kind::{self, Kind};

/// Scene and camera.
pub struct Traced {
    /// Everything there is, real and virtual.
    pub scene: Arc<TraceScene>,
    /// From where it is seen.
    pub camera: Camera,
    /// Most scattering events, if the file says.
    pub max_depth: Option<u32>,
}

impl Traced {
    /// `SESSION.toml`, or `WORLD.toml#SENSOR` at the true time of its frame `frame`.
    ///
    /// # Errors
    /// Name the file and the key that is missing or wrong.
    pub fn read(name: &str, frame: Option<u64>) -> anyhow::Result<Self> {
        match name.rsplit_once('#') {
            Some((world, sensor)) if !Path::new(name).exists() => {
                Self::of_world(Path::new(world), sensor, frame.unwrap_or(0))
            }
            _ => {
                let path = PathBuf::from(name);
                if kind::of(&path)? == Kind::World {
                    bail!("{name} is a world: say which sensor's picture, such as {name}#camera");
                }
                if frame.is_some() {
                    bail!(
                        "--frame: {name} is a session, whose camera stands still; only sensors of worlds have frames"
                    );
                }
                Self::of_session(&path)
            }
        }
    }

    fn of_world(path: &Path, sensor: &str, frame: u64) -> anyhow::Result<Self> {
        let world = World::read(path)?;
        let calibration = world.calibration(sensor)?;
        let tracer = Arc::new(world.tracer()?);
        let scene = Arc::clone(tracer.scene());
        let sensor = world.sensor(sensor, tracer)?;
        let count = sensor.frame_count();
        if frame >= count {
            bail!(
                "--frame {frame}: {} exposes {count} frames in {} s, the first is 0",
                sensor.name(),
                world.spec().duration_s
            );
        }
        if calibration.readout_s > 0.0 {
            tracing::warn!(
                "{}: rolling shutter is not traced, the whole picture is of its middle row's time",
                sensor.name()
            );
        }
        let pose = sensor.world_from_sensor(sensor.timing().time_s(frame)).similarity();
        let max_depth = Some(world.spec().trace.max_depth);
        Ok(Self { camera: Camera::of_calibration(&calibration, pose)?, scene, max_depth })
    }

    fn of_session(path: &Path) -> anyhow::Result<Self> {
        let session = Session::read(path)?;
        let assembled = assembled(&session)?;
        let scene = TraceScene::build(&assembled, environment(&session)?, |_| None)
            .with_context(|| path.display().to_string())?;
        Ok(Self { scene: Arc::new(scene), camera: camera(&session)?, max_depth: None })
    }
}

/// The things and lights of a session; what is odd about them goes to the log.
///
/// # Errors
/// [`Session::assemble`]'s, and a light whose strength is to be measured.
pub fn assembled(session: &Session) -> anyhow::Result<Scene> {
    let assembled = session.assemble()?;
    for warning in &assembled.warnings {
        tracing::warn!("{warning}");
    }
    if let Some(&index) = assembled.lights_to_fit.first() {
        bail!(
            "{}: light[{index}] has fit = true, but there is no image to fit it to: state its strength",
            session.path().display()
        );
    }
    Ok(assembled.scene)
}

/// The camera of a session, standing still.
///
/// # Errors
/// Name the key that is missing, or what is wrong with the calibration.
pub fn camera(session: &Session) -> anyhow::Result<Camera> {
    let path = session.path();
    let spec = &session.spec().camera;
    let pose = spec.pose.as_ref().ok_or_else(|| {
        anyhow!("{}: the camera has no place: write [camera] pose = {{ in = \"world\", … }}", path.display())
    })?;
    let calibration = spec.calibration.as_ref().ok_or_else(|| {
        anyhow!("{}: the camera has no lens: write [camera] calibration = \"camera.toml\"", path.display())
    })?;
    let calibration = Calibration::read(session.resolve(calibration))?;
    let world_from_camera = *session.pose(pose)?.frame_from_thing();
    Ok(Camera::of_calibration(&calibration, world_from_camera)?)
}

/// The environment of a session, `None` if it names none.
///
/// # Errors
/// Name the file that cannot be used.
pub fn environment(session: &Session) -> anyhow::Result<Option<Environment>> {
    let path = session.path();
    let spec = session.spec();
    if spec.fisheye.is_some() {
        tracing::warn!(
            "{}: the light of the fish-eye is not traced, only [environment] and [[light]]",
            path.display()
        );
    }
    let Some(environment) = &spec.environment else { return Ok(None) };
    if environment.room.is_some() {
        tracing::warn!("{}: the environment is traced as infinitely far, not as a room", path.display());
    }
    let file = session.resolve(&environment.file);
    let EnvironmentFile { environment, negative } = EnvironmentFile::read(&file, environment)?;
    if negative > 0 {
        tracing::warn!(
            "{}: {negative} samples below zero, as filters leave them, are taken as 0",
            file.display()
        );
    }
    Ok(Some(environment))
}
