//! The world file: a scene, its sensors and their faults, all as they truly are. `docs/world.md` lists its keys.

mod check;
mod keyframes;
mod scene;
pub mod spec;

use std::path::{Path as FilePath, PathBuf};
use std::sync::Arc;

use coshade_config::{Document, Error, Problem};
use coshade_lens::calibration::{Calibration, CalibrationError, Response};
use coshade_reference::emitter::{Environment, EnvironmentFile, EnvironmentFileError};
use coshade_reference::integrator::{TraceError, TraceScene};
use coshade_tracker::{Board, BoardMistake};

pub use scene::PlacedTag;
pub use spec::{MountSpec, SensorSpec, WorldSpec};

use crate::cache::ContentHash;
use crate::device::SimSensor;
use crate::path::Path;
use crate::pose::Rigid;
use crate::sensor::FormatSpec;
use crate::tracer::{PathTracer, Tracer};

/// Why a world cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// The file, or a board file, cannot be read or says something that is not allowed.
    #[error(transparent)]
    File(#[from] Error),
    /// A sensor's calibration cannot be used.
    #[error("sensor {sensor}: {source}")]
    Calibration {
        /// Name of the sensor.
        sensor: String,
        /// Why.
        source: Box<CalibrationError>,
    },
    /// A sensor's image cannot have its format.
    #[error("sensor {sensor}: {reason}")]
    Format {
        /// Name of the sensor.
        sensor: String,
        /// Why.
        reason: String,
    },
    /// There is no such sensor.
    #[error("{}: no sensor `{name}`; there {}", path.display(), match known.as_slice() { [one] => format!("is `{one}`"), all => format!("are {}", all.join(", ")) })]
    NoSensor {
        /// The world file.
        path: PathBuf,
        /// What was asked for.
        name: String,
        /// The sensors there are.
        known: Vec<String>,
    },
    /// A tag cannot be printed.
    #[error("tag {family} {id}: {reason}")]
    Tag {
        /// Its family.
        family: String,
        /// Its number.
        id: u32,
        /// Why not.
        reason: String,
    },
    /// A board's tags have no places.
    #[error("{}: {mistake}", path.display())]
    Board {
        /// The board file.
        path: PathBuf,
        /// What is wrong with it.
        mistake: BoardMistake,
    },
    /// The image of the environment cannot be used.
    #[error("environment: {0}")]
    Environment(#[from] EnvironmentFileError),
    /// The scene cannot be traced.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// Keyframes make no path.
    #[error(transparent)]
    Path(#[from] crate::path::PathError),
    /// The scene is refused without a reason.
    #[error("{}: things and lights make no scene", .0.display())]
    Nothing(PathBuf),
}

/// A world file.
#[derive(Clone, Debug)]
pub struct World {
    document: Document<WorldSpec>,
    path: Arc<Path>,
}

impl World {
    /// Reads a world. Files that it names are read when they are needed.
    ///
    /// # Errors
    /// [`WorldError::File`] with all problems at once, each with file, line, column and key.
    pub fn read(path: impl AsRef<FilePath>) -> Result<Self, WorldError> {
        Self::consistent(Document::read(path)?)
    }

    /// As [`World::read`] from a text; `path` is where the text came from.
    ///
    /// # Errors
    /// As [`World::read`].
    pub fn parse(text: &str, path: impl AsRef<FilePath>) -> Result<Self, WorldError> {
        Self::consistent(Document::parse(text, path)?)
    }

    fn consistent(document: Document<WorldSpec>) -> Result<Self, WorldError> {
        let problems: Vec<Problem> = check::problems(&document);
        Document::<WorldSpec>::reject(problems)?;
        let path = Arc::new(keyframes::path(document.value())?);
        Ok(Self { document, path })
    }

    /// What the file says.
    pub fn spec(&self) -> &WorldSpec {
        self.document.value()
    }

    /// The text of the file.
    pub fn text(&self) -> &str {
        self.document.text()
    }

    /// The file.
    pub fn file(&self) -> PathBuf {
        self.document.path()
    }

    /// The way of the rig.
    pub fn path(&self) -> &Arc<Path> {
        &self.path
    }

    /// A path of the file's, from where the program runs.
    pub fn resolve(&self, path: impl AsRef<FilePath>) -> PathBuf {
        match self.file().parent() {
            Some(folder) => folder.join(path),
            None => path.as_ref().to_path_buf(),
        }
    }

    /// All tags in their places, those of boards too.
    ///
    /// # Errors
    /// [`WorldError::File`] for a board file.
    pub fn tags(&self) -> Result<Vec<PlacedTag>, WorldError> {
        let single = self.spec().tags.iter().map(|spec| PlacedTag {
            family: spec.tag.family.clone(),
            id: spec.tag.id,
            size_m: spec.tag.size_m,
            world_from_tag: scene::rigid(&spec.pose),
        });
        let mut tags: Vec<PlacedTag> = single.collect();
        for spec in &self.spec().boards {
            let board = Board::read(self.resolve(&spec.file))?;
            let world_from_board = scene::rigid(&spec.pose);
            let placed = board
                .placed_tags()
                .map_err(|mistake| WorldError::Board { path: self.resolve(&spec.file), mistake })?;
            tags.extend(placed.into_iter().map(|tag| PlacedTag {
                family: tag.tag.family.name().to_owned(),
                id: tag.tag.id,
                size_m: tag.size_m,
                world_from_tag: world_from_board * Rigid::from(tag.body_from_tag),
            }));
        }
        Ok(tags)
    }

    /// The path tracer of this world: reads meshes, boards and the environment.
    ///
    /// # Errors
    /// [`WorldError`] names the file or key that cannot be used.
    pub fn tracer(&self) -> Result<PathTracer, WorldError> {
        let tags = self.tags()?;
        let scene = scene::assemble(&self.document, &tags)?;
        let environment = self.environment()?;
        let content = ContentHash::of(&(&scene, &environment)).to_string();
        let boards: Vec<(PathBuf, Rigid)> = self
            .spec()
            .boards
            .iter()
            .map(|board| (self.resolve(&board.file), scene::rigid(&board.pose)))
            .collect();
        let frame_of = |pose: &coshade_scene::Pose| scene::world_from_frame(pose, &tags, &boards);
        Ok(PathTracer::new(TraceScene::build(&scene, environment, frame_of)?, self.spec().trace, content))
    }

    fn environment(&self) -> Result<Option<Environment>, WorldError> {
        let Some(spec) = &self.spec().environment else { return Ok(None) };
        let path = self.resolve(&spec.file);
        let file = EnvironmentFile::read(&path, spec)?;
        if file.negative > 0 {
            tracing::warn!("{}: {} samples below zero are taken as 0", path.display(), file.negative);
        }
        Ok(Some(file.environment))
    }

    /// The true calibration of a sensor.
    ///
    /// # Errors
    /// [`WorldError::NoSensor`], [`WorldError::Calibration`], or [`WorldError::Format`] if the format cannot have its size
    /// or response.
    pub fn calibration(&self, sensor: &str) -> Result<Calibration, WorldError> {
        let spec = self.sensor_spec(sensor)?;
        let calibration = match (&spec.calibration, spec.size_px, spec.fov_deg) {
            (Some(file), ..) => Calibration::read(self.resolve(file)),
            (None, size_px, fov_deg) => {
                // The check of the file wants both.
                Calibration::default_for(size_px.unwrap_or([1, 1]), fov_deg.unwrap_or(60.0).to_radians())
            }
        };
        let mut calibration = calibration.map_err(|source| WorldError::Calibration {
            sensor: sensor.to_owned(),
            source: Box::new(source),
        })?;
        let unfit = |reason: String| WorldError::Format { sensor: sensor.to_owned(), reason };
        if spec.format == FormatSpec::RgbF32 && spec.calibration.is_none() {
            calibration.response = Response::Linear;
            calibration.provenance.notes = None;
        }
        if let Some(reason) = check::odd_size(spec.format, calibration.size_px) {
            return Err(unfit(reason));
        }
        let file = || spec.calibration.as_deref().unwrap_or(FilePath::new("")).display();
        let checked = spec.format.pixel_format().check_response(&calibration.response);
        checked.map_err(|error| unfit(format!("{}: {error}", file())))?;
        Ok(calibration)
    }

    /// A sensor that sees this world through a tracer.
    ///
    /// # Errors
    /// As [`World::calibration`].
    pub fn sensor(&self, name: &str, tracer: Arc<dyn Tracer>) -> Result<SimSensor, WorldError> {
        let spec = self.sensor_spec(name)?.clone();
        Ok(SimSensor::new(name, spec, self.calibration(name)?, self, tracer))
    }

    fn sensor_spec(&self, name: &str) -> Result<&SensorSpec, WorldError> {
        let no_sensor = || WorldError::NoSensor {
            path: self.file(),
            name: name.to_owned(),
            known: self.spec().sensors.keys().cloned().collect(),
        };
        self.spec().sensors.get(name).ok_or_else(no_sensor)
    }

    /// `world_from_sensor` or `rig_from_sensor`, as the sensor is mounted.
    pub(crate) fn mount(spec: &SensorSpec) -> Rigid {
        scene::rigid(&spec.pose)
    }
}
