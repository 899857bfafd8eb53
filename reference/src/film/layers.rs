//! A film as a layered image, and back.

use std::path::PathBuf;

use glam::Vec3;
use thiserror::Error;

use super::{Film, FilmPixel, ShardMark};
use coshade_image_file::{Channel, Image, ImageError, LayeredImage};

/// Why an image is no film.
#[derive(Debug, Error)]
pub enum FilmError {
    /// The file cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A layer is missing, or a channel of it.
    #[error(
        "no channel {channel:?} in a layer {layer:?}: not a file of `coshade reference`, or layers were removed"
    )]
    Missing {
        /// Layer.
        layer: String,
        /// Channel of it.
        channel: &'static str,
    },
    /// Which file.
    #[error("{}: {error}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: Box<FilmError>,
    },
}

const RGB: [&str; 3] = ["R", "G", "B"];
const XYZ: [&str; 3] = ["X", "Y", "Z"];
const SHARD: [&str; 4] = ["INDEX", "COUNT", "KEY0", "KEY1"];

type VectorLayer = (&'static str, [&'static str; 3], fn(&mut FilmPixel) -> &mut Vec3);

/// Layers of three channels.
const VECTORS: [VectorLayer; 8] = [
    ("real", RGB, |pixel| &mut pixel.real),
    ("mixed", RGB, |pixel| &mut pixel.mixed),
    ("difference", RGB, |pixel| &mut pixel.difference),
    ("normal", XYZ, |pixel| &mut pixel.normal),
    ("albedo", RGB, |pixel| &mut pixel.albedo),
    ("variance", RGB, |pixel| &mut pixel.variance),
    ("variance_real", RGB, |pixel| &mut pixel.variance_real),
    ("variance_mixed", RGB, |pixel| &mut pixel.variance_mixed),
];

impl Film {
    /// All layers, see [`super`].
    ///
    /// # Errors
    /// Only for a film whose pixels do not fill its size.
    pub fn to_layers(&self) -> Result<LayeredImage, ImageError> {
        let mut file = LayeredImage::default();
        for (layer, channels, field) in VECTORS {
            let plane = |axis: usize| {
                self.plane(|pixel| {
                    let mut copy = *pixel;
                    field(&mut copy)[axis]
                })
            };
            file.push(
                layer,
                self.image(channels.iter().enumerate().map(|(axis, name)| (*name, plane(axis))))?,
            )?;
        }
        file.push(depth_layer(self.depth_is_range), self.image([("Z", self.plane(|pixel| pixel.depth_m))])?)?;
        file.push("coverage", self.image([("Y", self.plane(|pixel| pixel.coverage))])?)?;
        file.push("samples", self.image([("N", self.plane(|pixel| pixel.samples as f32))])?)?;
        if let Some(shard) = self.shard {
            let planes = SHARD.into_iter().zip(shard.to_floats());
            file.push("shard", self.image(planes.map(|(name, value)| (name, self.plane(|_| value))))?)?;
        }
        Ok(file)
    }

    /// What [`Film::to_layers`] made.
    ///
    /// # Errors
    /// [`FilmError::Missing`] names the first channel that is not there.
    pub fn from_layers(file: &LayeredImage) -> Result<Self, FilmError> {
        let plane = |layer: &str, channel: &'static str| {
            let found = file.layer(layer).and_then(|image| image.channel(channel));
            found.ok_or(FilmError::Missing { layer: layer.into(), channel })
        };
        let samples = plane("samples", "N")?;
        let mut pixels: Vec<FilmPixel> = samples
            .iter()
            .map(|&samples| FilmPixel { samples: samples as u32, ..FilmPixel::default() })
            .collect();
        for (layer, channels, field) in VECTORS {
            for (axis, channel) in channels.into_iter().enumerate() {
                for (pixel, &value) in pixels.iter_mut().zip(plane(layer, channel)?) {
                    field(pixel)[axis] = value;
                }
            }
        }
        let depth_is_range = file.layer(depth_layer(true)).is_some();
        for (pixel, &depth_m) in pixels.iter_mut().zip(plane(depth_layer(depth_is_range), "Z")?) {
            pixel.depth_m = depth_m;
        }
        for (pixel, &coverage) in pixels.iter_mut().zip(plane("coverage", "Y")?) {
            pixel.coverage = coverage;
        }
        let mark = |channel| plane("shard", channel).ok().and_then(|plane| plane.first().copied());
        let shard = match SHARD.map(mark) {
            [Some(index), Some(count), Some(key_0), Some(key_1)] => {
                Some(ShardMark::from_floats([index, count, key_0, key_1]))
            }
            _ => None,
        };
        let size_px =
            file.layer("samples").map_or([0, 0], |image| [image.width() as u32, image.height() as u32]);
        Ok(Self { size_px, depth_is_range, pixels, shard, rejected_samples: 0 })
    }

    fn plane(&self, value: impl Fn(&FilmPixel) -> f32) -> Vec<f32> {
        self.pixels.iter().map(value).collect()
    }

    fn image<'a>(&self, planes: impl IntoIterator<Item = (&'a str, Vec<f32>)>) -> Result<Image, ImageError> {
        let [width, height] = self.size_px.map(|side| side as usize);
        let channel = |(name, samples): (&str, Vec<f32>)| Channel { name: name.into(), samples };
        Image::new(width, height, planes.into_iter().map(channel).collect())
    }
}

fn depth_layer(is_range: bool) -> &'static str {
    if is_range { "range_m" } else { "depth_z_m" }
}
