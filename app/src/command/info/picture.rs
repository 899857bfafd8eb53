//! Images: EXR, Radiance HDR, PNG, JPEG.

use std::fmt::Write as _;
use std::path::Path;

use coshade_image_file::{Channel, Layer};
use image::{ColorType, ImageDecoder as _, ImageFormat};
use serde_json::json;

use super::{Found, Problem, Severity, folder};

pub fn look(path: &Path, depth_unit_m: Option<f64>) -> anyhow::Result<Found> {
    let coding = Coding::of(path);
    if coding == Coding::Grey16 {
        return folder::look_at_file(path, depth_unit_m);
    }
    let image = coshade_image_file::read(path)?;
    let mut text = match coding {
        Coding::Linear => String::from("  values are linear, 1 = white\n"),
        _ => String::from("  values are linear, 1 = white, decoded from sRGB\n"),
    };
    let mut layers = Vec::new();
    for layer in &image.layers {
        let (line, content) = layer_figures(layer);
        text += &line;
        layers.push(content);
    }
    let problems = image.notes.iter().map(|note| Problem::new(Severity::Warning, note.clone())).collect();
    Ok(Found { content: json!({ "layers": layers }), text, problems })
}

/// How the file holds its values.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Coding {
    /// EXR, Radiance HDR.
    Linear,
    /// PNG and JPEG of colour, or 8 bit.
    Srgb,
    /// Depth, or a machine's camera.
    Grey16,
}

impl Coding {
    /// A file that cannot be decoded counts as linear: reading it says what is wrong.
    fn of(path: &Path) -> Self {
        let decoder = image::ImageReader::open(path)
            .and_then(image::ImageReader::with_guessed_format)
            .ok()
            .filter(|reader| matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)))
            .and_then(|reader| reader.into_decoder().ok());
        match decoder.map(|decoder| decoder.color_type()) {
            None => Self::Linear,
            Some(ColorType::L16) => Self::Grey16,
            Some(_) => Self::Srgb,
        }
    }
}

fn layer_figures(layer: &Layer) -> (String, serde_json::Value) {
    let image = &layer.image;
    let (width, height) = (image.width(), image.height());
    let name = if layer.name.is_empty() { String::new() } else { format!("layer {}: ", layer.name) };
    let mut line = format!("  {name}{width}x{height} px, {} channels\n", image.channels().len());
    let mut channels = Vec::new();
    for channel in image.channels() {
        let Range { min, mean, max } = Range::of(channel);
        let _ = writeln!(line, "    {:<8} min {min:<12.6} mean {mean:<12.6} max {max:.6}", channel.name);
        channels.push(json!({ "name": channel.name, "min": min, "mean": mean, "max": max }));
    }
    let census = image.census();
    if census.nan + census.infinite > 0 {
        let _ = writeln!(line, "    {} samples are not a number, {} infinite", census.nan, census.infinite);
    }
    if census.negative > 0 {
        let _ = writeln!(line, "    {} samples are below 0", census.negative);
    }
    let content = json!({
        "name": layer.name,
        "width_px": width,
        "height_px": height,
        "channels": channels,
        "nan_samples": census.nan,
        "infinite_samples": census.infinite,
        "negative_samples": census.negative,
    });
    (line, content)
}

/// Of the finite samples of a channel; all 0 where there is none.
struct Range {
    min: f32,
    mean: f64,
    max: f32,
}

impl Range {
    fn of(channel: &Channel) -> Self {
        let finite = || channel.samples.iter().copied().filter(|sample| sample.is_finite());
        let count = finite().count().max(1);
        Self {
            min: finite().reduce(f32::min).unwrap_or(0.0),
            mean: finite().map(f64::from).sum::<f64>() / count as f64,
            max: finite().reduce(f32::max).unwrap_or(0.0),
        }
    }
}
