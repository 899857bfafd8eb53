//! The environment that a session or a world names.

use std::path::{Path, PathBuf};

use coshade_scene::session::sensors::EnvironmentSpec;
use thiserror::Error;

use super::environment::{Environment, EnvironmentError, Interpolation, Layout};
use coshade_image_file::{Image, ImageError};

/// Why a file is no environment.
#[derive(Debug, Error)]
pub enum EnvironmentFileError {
    /// It cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// It can, but is not a picture of light.
    #[error("{}: {error}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: EnvironmentError,
    },
}

/// An environment, and how many of its file's samples were below zero, as filters leave them: they are taken as 0.
#[derive(Clone, Debug)]
pub struct EnvironmentFile {
    /// The light.
    pub environment: Environment,
    /// Samples below zero.
    pub negative: u64,
}

impl EnvironmentFile {
    /// Reads the equirectangular image at `path`, scaled and turned as `spec` says (whose own path is relative to its file).
    ///
    /// # Errors
    /// [`EnvironmentFileError`] names the file.
    pub fn read(path: &Path, spec: &EnvironmentSpec) -> Result<Self, EnvironmentFileError> {
        let failed = |error| EnvironmentFileError::Content { path: path.into(), error };
        let first = coshade_image_file::read(path)?.layers.into_iter().next();
        let image = first.ok_or_else(|| failed(EnvironmentError::Channels))?.image;
        let negative = image.census().negative;
        let image = radiance(image, spec.scale as f32)?;
        let yaw_rad = spec.yaw_deg.to_radians() as f32;
        let environment = Environment::from_image(Layout::LatLong, &image, Interpolation::default(), yaw_rad);
        Ok(Self { environment: environment.map_err(failed)?, negative })
    }
}

/// Samples times `factor`, none below zero. What is no number stays, to be refused with its place.
fn radiance(image: Image, factor: f32) -> Result<Image, ImageError> {
    let (width, height) = (image.width(), image.height());
    let mut channels = image.channels().to_vec();
    for sample in channels.iter_mut().flat_map(|channel| &mut channel.samples) {
        *sample = if *sample < 0.0 { 0.0 } else { *sample * factor };
    }
    Image::new(width, height, channels)
}
