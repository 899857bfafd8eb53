use std::io::{BufWriter, Cursor};
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer as ExrLayer, LayerAttributes,
    SmallVec, Vec2, WritableImage, f16,
};

use super::ImageError;
use super::image::{ColourKind, LayeredImage};

/// Samples of a written EXR.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// All in 16 bits.
    Half,
    /// All in 32 bits.
    Float,
    /// Colour and grey layers in 16 bits, data (depth, normals) in 32.
    HalfColour,
}

/// Writes all layers as one part, channels named `layer.R`: what OpenCV, Blender, Nuke and tev read.
///
/// Compressed losslessly (ZIP). A layer's window is not kept: the data window begins at (0, 0).
///
/// # Errors
/// No layers, layers of different sizes, a finite value beyond the range of half floats (65504), or the file cannot be
/// written.
pub fn write_exr(
    path: impl AsRef<Path>,
    file: &LayeredImage,
    precision: Precision,
) -> Result<(), ImageError> {
    let path = path.as_ref();
    let first = file.layers.first().ok_or_else(|| ImageError::write(path, "there is no layer"))?;
    let size = Vec2(first.image.width(), first.image.height());
    let mut channels = SmallVec::<[AnyChannel<FlatSamples>; 4]>::new();
    for layer in &file.layers {
        if Vec2(layer.image.width(), layer.image.height()) != size {
            let (a, b) = (&first.name, &layer.name);
            let (w, h) = (layer.image.width(), layer.image.height());
            let reason = format!("layer {a:?} is {}x{} px and layer {b:?} {w}x{h} px", size.0, size.1);
            return Err(ImageError::write(path, reason));
        }
        let is_data = layer.image.colour_kind() == ColourKind::Data;
        let half = precision == Precision::Half || (precision == Precision::HalfColour && !is_data);
        for channel in layer.image.channels() {
            let name = if layer.name.is_empty() {
                channel.name.clone()
            } else {
                format!("{}.{}", layer.name, channel.name)
            };
            let text = exr::prelude::Text::new_or_none(&name)
                .ok_or_else(|| ImageError::write(path, format!("channel name {name:?} is not ASCII")))?;
            let samples = if half {
                to_half(path, &name, &channel.samples)?
            } else {
                FlatSamples::F32(channel.samples.clone())
            };
            channels.push(AnyChannel::new(text, samples));
        }
    }
    let layer = ExrLayer::new(
        size,
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let image = ExrImage::from_layer(layer);
    let mut encoded = Cursor::new(Vec::new());
    let written = image.write().non_parallel().to_buffered(BufWriter::new(&mut encoded));
    written.map_err(|error| ImageError::write(path, error))?;
    std::fs::write(path, encoded.into_inner()).map_err(|error| ImageError::write(path, error))
}

fn to_half(path: &Path, name: &str, samples: &[f32]) -> Result<FlatSamples, ImageError> {
    let halves: Vec<f16> = samples.iter().map(|&sample| f16::from_f32(sample)).collect();
    let overflow = halves.iter().zip(samples).find(|(half, sample)| sample.is_finite() && !half.is_finite());
    match overflow {
        Some((_, sample)) => Err(ImageError::write(
            path,
            format!("{sample} in channel {name} is beyond half floats (65504); write it as float"),
        )),
        None => Ok(FlatSamples::F16(halves)),
    }
}
