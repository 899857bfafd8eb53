//! A truth case: pictures of a scene whose truth is known, see `tests/truth/README.md`.

use std::path::{Path, PathBuf};

use coshade_image_file::{Image, ImageError, LayeredImage};
use glam::Vec3;

/// Radiances are compared up to so many times code white: what a display shows is not judged by the lamp in it.
pub const CLIP: f32 = 4.0;

/// Why a folder is no truth case.
#[derive(Debug, thiserror::Error)]
pub enum TruthCaseError {
    /// A picture cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A layer is missing.
    #[error("{}: no layer {layer:?} with channels {channels}", file.display())]
    Layer {
        /// The picture.
        file: PathBuf,
        /// The layer.
        layer: &'static str,
        /// What was looked for in it.
        channels: &'static str,
    },
    /// Pictures of different sizes.
    #[error("{}: camera.exr and truth.exr have different sizes", .0.display())]
    Size(PathBuf),
}

/// Pixels by what the camera would see in them if the virtual things were there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelSet {
    /// Nothing virtual.
    Real,
    /// Nothing else.
    Virtual,
    /// Both.
    Edge,
}

impl PixelSet {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Real, Self::Virtual, Self::Edge];

    fn of(coverage: f32) -> Self {
        match coverage {
            c if c <= 0.0 => Self::Real,
            c if c >= 1.0 => Self::Virtual,
            _ => Self::Edge,
        }
    }
}

/// The clean pictures of a case, row by row, in linear radiance.
#[derive(Clone, Debug)]
pub struct TruthCase {
    /// Width and height, pixels.
    pub size_px: [usize; 2],
    /// The real world, as the camera sees it.
    pub real: Vec<Vec3>,
    /// The same with the virtual things really there.
    pub mixed: Vec<Vec3>,
    /// `mixed − real`, without the noise both share.
    pub difference: Vec<Vec3>,
    /// Standard error of the difference.
    pub difference_error: Vec<Vec3>,
    /// Share of the pixel that virtual things cover.
    pub coverage: Vec<f32>,
}

impl TruthCase {
    /// Reads `camera.exr` and `truth.exr` of a case's folder.
    ///
    /// # Errors
    /// [`TruthCaseError`] names the file, and the layer that is missing.
    pub fn read(folder: &Path) -> Result<Self, TruthCaseError> {
        let (camera_file, truth_file) = (folder.join("camera.exr"), folder.join("truth.exr"));
        let (camera, truth) =
            (coshade_image_file::read(&camera_file)?, coshade_image_file::read(&truth_file)?);
        let size = |image: &Image| [image.width(), image.height()];
        let mixed = layer(&truth, &truth_file, "mixed")?;
        let real = layer(&camera, &camera_file, "")?;
        if size(mixed) != size(real) {
            return Err(TruthCaseError::Size(folder.into()));
        }
        let coverage = truth.layer("coverage").and_then(|image| image.channel("Y"));
        let no_coverage =
            || TruthCaseError::Layer { file: truth_file.clone(), layer: "coverage", channels: "Y" };
        Ok(Self {
            size_px: size(mixed),
            real: rgb(real, &camera_file, "")?,
            mixed: rgb(mixed, &truth_file, "mixed")?,
            difference: rgb(layer(&truth, &truth_file, "difference")?, &truth_file, "difference")?,
            difference_error: rgb(
                layer(&truth, &truth_file, "difference_error")?,
                &truth_file,
                "difference_error",
            )?,
            coverage: coverage.ok_or_else(no_coverage)?.to_vec(),
        })
    }

    /// Root mean square, over the pixels of a set and the channels, of what is wrong with the picture `image` of the mixed
    /// world; both clipped at [`CLIP`].
    pub fn rmse(&self, image: &[Vec3], set: PixelSet) -> f64 {
        let clipped = |value: Vec3| value.min(Vec3::splat(CLIP));
        let pairs = image.iter().zip(&self.mixed);
        self.root_mean_square(pairs.map(|(image, truth)| clipped(*image) - clipped(*truth)), set)
    }

    /// What the truth itself is not sure of: [`TruthCase::difference_error`], root mean square over a set. Radiance that is
    /// surely above [`CLIP`] has no say: whatever it is, it is clipped.
    pub fn standard_error(&self, set: PixelSet) -> f64 {
        const SURELY: f32 = 3.0;
        let errors = self.difference_error.iter().zip(&self.mixed).map(|(error, mixed)| {
            let counts = (*mixed - *error * SURELY).cmplt(Vec3::splat(CLIP));
            Vec3::select(counts, *error, Vec3::ZERO)
        });
        self.root_mean_square(errors, set)
    }

    /// Pixels of a set.
    pub fn count(&self, set: PixelSet) -> usize {
        self.coverage.iter().filter(|coverage| PixelSet::of(**coverage) == set).count()
    }

    fn root_mean_square(&self, values: impl Iterator<Item = Vec3>, set: PixelSet) -> f64 {
        let of_set = values.zip(&self.coverage).filter(|(_, coverage)| PixelSet::of(**coverage) == set);
        let (sum, count) = of_set.fold((0.0, 0_u32), |(sum, count), (value, _)| {
            (sum + value.as_dvec3().length_squared(), count + 3)
        });
        if count == 0 { 0.0 } else { (sum / f64::from(count)).sqrt() }
    }
}

fn layer<'a>(image: &'a LayeredImage, file: &Path, layer: &'static str) -> Result<&'a Image, TruthCaseError> {
    let missing = || TruthCaseError::Layer { file: file.into(), layer, channels: "R, G, B" };
    image.layer(layer).ok_or_else(missing)
}

fn rgb(image: &Image, file: &Path, layer: &'static str) -> Result<Vec<Vec3>, TruthCaseError> {
    let missing = || TruthCaseError::Layer { file: file.into(), layer, channels: "R, G, B" };
    let [r, g, b] = image.rgb().ok_or_else(missing)?;
    Ok(r.iter().zip(g).zip(b).map(|((r, g), b)| Vec3::new(*r, *g, *b)).collect())
}
