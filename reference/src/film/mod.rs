//! The picture: both worlds, their difference, what is seen, and how sure all that is.
//!
//! | layer | channels | what it is |
//! | --- | --- | --- |
//! | `real` | R G B | radiance of the real world, L_r: real things in real light |
//! | `mixed` | R G B | radiance of the mixed world, L_rv: everything |
//! | `difference` | R G B | mixed − real, without the noise both share; exactly 0 where nothing virtual has a say |
//! | `depth_z_m` or `range_m` | Z | first surface of the mixed world: z along the axis for pinhole-like lenses, distance from the camera's centre for wider ones; mean over the samples that hit something, 0 where none does |
//! | `normal` | X Y Z | mean shading normal there, world coordinates; shorter than 1 at edges |
//! | `albedo` | R G B | mean base colour there; 0 where nothing is hit |
//! | `coverage` | Y | share of the samples whose first surface is virtual |
//! | `variance` | R G B | of `difference`: variance of the mean, estimated from the samples |
//! | `variance_real`, `variance_mixed` | R G B | the same of the two worlds |
//! | `samples` | N | how many samples the pixel has |
//! | `shard` | INDEX COUNT KEY0 KEY1 | in files of shards only: which one it is, and of which job |
//!
//! Variances are those of independent samples; the samples are stratified, so the true errors are no larger, and often
//! smaller. They are infinite where a pixel has but one sample. In half floats, variances below 6e-8 become 0: write
//! [`Precision::Float`] where they matter.

mod layers;
mod merge;
mod pixel;

use std::path::Path;

use glam::Vec3;

pub use layers::FilmError;
pub use merge::{MAX_SHARDS, MergeError, ShardMark, merge};
pub use pixel::{FilmPixel, PixelSums};

use coshade_image_file::{ImageError, Precision, write_exr};

/// A finished picture, or a shard's part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Width and height.
    pub size_px: [u32; 2],
    /// Depth is range, not z.
    pub depth_is_range: bool,
    /// Row by row from the top.
    pub pixels: Vec<FilmPixel>,
    /// Set on a part.
    pub shard: Option<ShardMark>,
    /// Camera samples whose radiance was infinite or not a number; they were left out. A material or light of absurd
    /// numbers is the cause.
    pub rejected_samples: u64,
}

/// Means over all pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmFigures {
    /// Fewest samples of any pixel of this film's own part.
    pub samples_min: u32,
    /// Root mean square of `difference`.
    pub difference_rms: f64,
    /// Standard error of `difference`, root mean square.
    pub difference_error_rms: f64,
    /// Root mean square of `mixed`.
    pub mixed_rms: f64,
    /// Standard error of `mixed`, root mean square.
    pub mixed_error_rms: f64,
}

impl FilmFigures {
    /// Of pixels that have samples.
    pub fn of<'a>(pixels: impl Iterator<Item = &'a FilmPixel>) -> Self {
        let mut count = 0_u64;
        let mut samples_min = u32::MAX;
        let mut squares = [0.0_f64; 4];
        let square = |value: Vec3| value.as_dvec3().length_squared();
        for pixel in pixels.filter(|pixel| pixel.samples > 0) {
            count += 3;
            samples_min = samples_min.min(pixel.samples);
            let terms = [
                square(pixel.difference),
                pixel.variance.as_dvec3().element_sum(),
                square(pixel.mixed),
                pixel.variance_mixed.as_dvec3().element_sum(),
            ];
            for (sum, term) in squares.iter_mut().zip(terms) {
                *sum += term;
            }
        }
        let [difference_rms, difference_error_rms, mixed_rms, mixed_error_rms] =
            squares.map(|sum| (sum / count.max(1) as f64).sqrt());
        let samples_min = if count == 0 { 0 } else { samples_min };
        Self { samples_min, difference_rms, difference_error_rms, mixed_rms, mixed_error_rms }
    }

    /// Standard error by signal: of the difference; where the worlds do not differ, of the mixed world. 0 for a black
    /// picture. The signal is freed of the noise's own share.
    pub fn relative_error(&self) -> f64 {
        let (error, signal) = if self.difference_rms > 0.0 {
            (self.difference_error_rms, self.difference_rms)
        } else {
            (self.mixed_error_rms, self.mixed_rms)
        };
        if error == 0.0 {
            return 0.0;
        }
        let clean = (signal * signal - error * error).max(0.0).sqrt();
        if clean > 0.0 { error / clean } else { f64::INFINITY }
    }
}

impl Film {
    /// How good it is.
    pub fn figures(&self) -> FilmFigures {
        FilmFigures::of(self.pixels.iter())
    }

    /// A pixel; `None` outside.
    pub fn pixel(&self, x: u32, y: u32) -> Option<&FilmPixel> {
        let [width, _] = self.size_px;
        if x >= width {
            return None;
        }
        self.pixels.get(y as usize * width as usize + x as usize)
    }

    /// Writes all layers as EXR.
    ///
    /// # Errors
    /// As [`write_exr`].
    pub fn write(&self, path: impl AsRef<Path>, precision: Precision) -> Result<(), ImageError> {
        write_exr(path, &self.to_layers()?, precision)
    }

    /// Reads what [`Film::write`] wrote in [`Precision::Float`], bit by bit the same (but for the count of rejected
    /// samples).
    ///
    /// # Errors
    /// [`FilmError`] if the file cannot be read or lacks a layer.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FilmError> {
        let path = path.as_ref();
        Self::from_layers(&coshade_image_file::read(path)?)
            .map_err(|error| FilmError::InFile { path: path.into(), error: Box::new(error) })
    }
}

#[cfg(test)]
mod tests;
