//! Images: EXR, Radiance HDR, PNG, JPEG.

use std::fmt::Write as _;
use std::path::Path;

use coshade_reference::image_file::{self, Channel, Layer};
use serde_json::json;

use super::{Found, Problem, Severity};

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let image = image_file::read(path)?;
    let mut text = String::from("  values are linear, 1 = white; 8 and 16 bit files are decoded from sRGB\n");
    let mut layers = Vec::new();
    for layer in &image.layers {
        let (line, content) = layer_figures(layer);
        text += &line;
        layers.push(content);
    }
    let problems = image.notes.iter().map(|note| Problem::new(Severity::Warning, note.clone())).collect();
    Ok(Found { content: json!({ "layers": layers }), text, problems })
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
