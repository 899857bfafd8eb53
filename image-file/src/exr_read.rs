//! OpenEXR: every flat layer at full resolution, of single- and multi-part files, scan lines and tiles.
//!
//! Layers follow the usual naming: channel `real.R` is `R` of layer `real`; a channel without a prefix belongs to the
//! layer named like its part, or to the unnamed layer if the file has one part. The pixels are those of the data
//! window; [`Window`] says where it sat.

use std::io::Cursor;
use std::panic::catch_unwind;
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::IntegerBounds;
use exr::prelude::{FlatImage, FlatSamples, ReadChannels, ReadLayers, Vec2};

use super::image::{Channel, Image, LayeredImage, Window};
use super::{ImageError, LayerOutline, ReadLimits, exr_dwa};

const PART: &str = "EXR";

pub(super) fn read(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<LayeredImage, ImageError> {
    headers(path, bytes, limits)?;

    let file = decode(path, bytes)?;
    let display = file.attributes.display_window;
    let parts = file.layer_data.len();
    let mut result = LayeredImage::default();
    for part in file.layer_data {
        let window = window(part.attributes.layer_position, display);
        let name = part.attributes.layer_name.map(|name| name.to_string()).unwrap_or_default();
        let own_name = if parts > 1 { name.as_str() } else { "" };
        let channels = part.channel_data.list.into_iter().map(|channel| {
            let name = channel.name.to_string();
            let samples = floats(channel.sample_data, &name, &mut result.notes);
            (name, samples)
        });
        for (prefix, channels) in group_by_prefix(channels.collect()) {
            let layer = layer_name(|name| result.layer(name).is_some(), own_name, &prefix);
            let channel = |(name, samples)| Channel { name, samples };
            let mut channels: Vec<Channel> = channels.into_iter().map(channel).collect();
            Image::sort_channels(&mut channels, |channel| &channel.name);
            let image = Image::new(part.size.0, part.size.1, channels)
                .map_err(|error| ImageError::decode(path, PART, format!("layer {layer:?}: {error}")))?;
            let pushed = result.push(&layer, image.with_window(window));
            pushed.map_err(|error| ImageError::decode(path, PART, error))?;
        }
    }
    result.note_non_finite();
    Ok(result)
}

/// The layers that [`read`] would give.
pub(super) fn outline(
    path: &Path,
    bytes: &[u8],
    limits: &ReadLimits,
) -> Result<Vec<LayerOutline>, ImageError> {
    let meta = headers(path, bytes, limits)?;
    let parts = meta.headers.len();
    let mut layers: Vec<LayerOutline> = Vec::new();
    for part in meta.headers {
        let name = part.own_attributes.layer_name.map(|name| name.to_string()).unwrap_or_default();
        let own_name = if parts > 1 { name.as_str() } else { "" };
        let channels = part.channels.list.into_iter().map(|channel| (channel.name.to_string(), ()));
        for (prefix, channels) in group_by_prefix(channels.collect()) {
            let is_taken = |name: &str| layers.iter().any(|layer| layer.name == name);
            let mut channels: Vec<String> = channels.into_iter().map(|(name, ())| name).collect();
            Image::sort_channels(&mut channels, |name| name);
            layers.push(LayerOutline {
                name: layer_name(is_taken, own_name, &prefix),
                width: part.layer_size.0,
                height: part.layer_size.1,
                channels,
                window: Some(window(
                    part.own_attributes.layer_position,
                    part.shared_attributes.display_window,
                )),
            });
        }
    }
    Ok(layers)
}

fn window(Vec2(x, y): Vec2<i32>, display: IntegerBounds) -> Window {
    Window {
        data_origin_px: [x, y],
        display_origin_px: [display.position.0, display.position.1],
        display_size_px: [display.size.0, display.size.1],
    }
}

/// The crate's decoder, with its panics made errors: exr 1.74 overflows on broken B44 blocks when built with checks.
fn decode(path: &Path, bytes: &[u8]) -> Result<FlatImage, ImageError> {
    // One thread: a panic in the crate's own pool would end the process.
    let decode = || {
        exr_dwa::check_sections(bytes)?;
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
    };
    match catch_unwind(decode) {
        Ok(result) => result.map_err(|error| ImageError::decode(path, PART, error)),
        Err(_) => Err(ImageError::decode(path, PART, "the decoder failed on its compressed pixels")),
    }
}

/// Refuses what cannot be read, and sizes beyond the limits, before any pixel is allocated.
fn headers(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<MetaData, ImageError> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| ImageError::decode(path, PART, error))?;
    let mut total_bytes = 0u64;
    for header in &meta.headers {
        if header.deep {
            return Err(ImageError::unsupported(
                path,
                "holds deep data (several samples per pixel); flatten it, for instance with oiiotool --flatten",
            ));
        }
        for channel in &header.channels.list {
            let (name, Vec2(x, y)) = (&channel.name, channel.sampling);
            if (x, y) != (1, 1) {
                return Err(ImageError::unsupported(
                    path,
                    format!(
                        "channel {name} is subsampled ({x}x{y}), as in luminance-chroma files; write it with R G B"
                    ),
                ));
            }
            let base = name.to_string();
            let base = base.rsplit('.').next().unwrap_or_default();
            if matches!(base, "RY" | "BY") {
                return Err(ImageError::unsupported(
                    path,
                    format!("channel {name} holds colour as luminance-chroma; write it with R G B"),
                ));
            }
        }
        let (width, height, channels) =
            (header.layer_size.0, header.layer_size.1, header.channels.list.len());
        total_bytes = total_bytes.saturating_add(limits.check(path, width, height, channels)?);
        if total_bytes > limits.max_decoded_bytes {
            return Err(ImageError::TooLarge {
                path: path.into(),
                width,
                height,
                channels: meta.headers.iter().map(|header| header.channels.list.len()).sum(),
                limit_bytes: limits.max_decoded_bytes,
                limit_side_px: limits.max_side_px,
            });
        }
    }
    Ok(meta)
}

/// Splits `real.R` into layer and channel; layers in the order of their first channel.
fn group_by_prefix<T>(channels: Vec<(String, T)>) -> Vec<(String, Vec<(String, T)>)> {
    let mut groups: Vec<(String, Vec<(String, T)>)> = Vec::new();
    for (full_name, content) in channels {
        let (prefix, name) = full_name.rsplit_once('.').unwrap_or(("", &full_name));
        let channel = (name.to_owned(), content);
        match groups.iter_mut().find(|(existing, _)| existing == prefix) {
            Some((_, members)) => members.push(channel),
            None => groups.push((prefix.into(), vec![channel])),
        }
    }
    groups
}

fn floats(samples: FlatSamples, name: &str, notes: &mut Vec<String>) -> Vec<f32> {
    match samples {
        FlatSamples::F32(samples) => samples,
        FlatSamples::F16(samples) => samples.into_iter().map(|sample| sample.to_f32()).collect(),
        FlatSamples::U32(samples) => {
            let rounded =
                samples.iter().filter(|&&sample| (sample as f32) as u64 != u64::from(sample)).count();
            if rounded > 0 {
                notes.push(format!("channel {name}: {rounded} integers do not fit a float and are rounded"));
            }
            samples.into_iter().map(|sample| sample as f32).collect()
        }
    }
}

/// The prefix, or the part's name without one; both if another part has that name already.
fn layer_name(is_taken: impl Fn(&str) -> bool, part: &str, prefix: &str) -> String {
    let short = if prefix.is_empty() { part } else { prefix };
    if is_taken(short) && !part.is_empty() && short != part {
        format!("{part}.{prefix}")
    } else {
        short.into()
    }
}
