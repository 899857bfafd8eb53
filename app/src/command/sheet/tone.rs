//! From samples to what can be looked at.

use coshade_image_file::{Image, srgb};
use coshade_reference::compare::colour_map;
use image::{Rgb, RgbImage};

/// The share of samples that a scale must hold: the rest, fireflies and lamps, is clipped.
const WITHIN: f64 = 0.995;
/// Of a pixel without depth, or that is no number.
const NOTHING: [u8; 3] = [30, 30, 34];

/// A picture, and what must be said about it.
pub struct Toned {
    /// To be looked at.
    pub image: RgbImage,
    /// How it was scaled.
    pub note: Option<String>,
}

/// Shows an image by what its channels are: colours, a signed difference, directions, depth, or grey.
pub fn tone(image: &Image, exposure_ev: f32) -> Toned {
    let channels: Vec<&[f32]> = match image.rgb() {
        Some(rgb) => rgb.to_vec(),
        None => image.channels().iter().take(3).map(|channel| channel.samples.as_slice()).collect(),
    };
    let names = image.channel_names();
    let signed = channels.iter().any(|plane| plane.iter().any(|sample| *sample < 0.0));
    let pixels = |of: &dyn Fn([f32; 3]) -> [u8; 3]| drawn(image, &channels, of);
    if names == ["X", "Y", "Z"] {
        let part = |x: f32| ((x.clamp(-1.0, 1.0) + 1.0) * 127.5).round() as u8;
        return Toned { image: pixels(&|direction| direction.map(part)), note: None };
    }
    if names == ["Z"] {
        return depth(image, channels.first().copied().unwrap_or_default());
    }
    if signed {
        let limit = percentile(channels.iter().flat_map(|plane| plane.iter().map(|sample| sample.abs())));
        let part = |x: f32| (127.5 + 127.5 * (x / limit).clamp(-1.0, 1.0)).round() as u8;
        return Toned { image: pixels(&|x| x.map(part)), note: Some(format!("±{}", short(limit))) };
    }
    let factor = exposure_ev.exp2();
    let code = |x: f32| srgb::encode_to_code(x * factor, 255) as u8;
    Toned { image: pixels(&|x| x.map(code)), note: None }
}

/// Depths in metres, 0 or infinite where there is none: near is light, far is dark.
fn depth(image: &Image, plane: &[f32]) -> Toned {
    let there = |depth: f32| depth > 0.0 && depth.is_finite();
    let known = || plane.iter().copied().filter(|depth| there(*depth));
    let (near, far) = (known().fold(f32::INFINITY, f32::min), percentile(known()));
    let colour = |[depth, ..]: [f32; 3]| {
        if !there(depth) {
            return NOTHING;
        }
        let share = f64::from((depth - near) / (far - near).max(f32::MIN_POSITIVE));
        colour_map::magma(1.0 - 0.9 * share.clamp(0.0, 1.0))
    };
    let note = near.is_finite().then(|| format!("{}–{} m", short(near), short(far)));
    Toned { image: drawn(image, &[plane], &colour), note }
}

fn drawn(image: &Image, channels: &[&[f32]], of: &dyn Fn([f32; 3]) -> [u8; 3]) -> RgbImage {
    let width = image.width();
    RgbImage::from_fn(width as u32, image.height() as u32, |x, y| {
        let index = y as usize * width + x as usize;
        // A single channel is grey.
        let at = |i: usize| channels.get(i).or(channels.first()).and_then(|plane| plane.get(index)).copied();
        let sample = [0, 1, 2].map(|i| at(i).unwrap_or(f32::NAN));
        Rgb(if sample.iter().any(|x| x.is_nan()) { NOTHING } else { of(sample) })
    })
}

/// Value that [`WITHIN`] of them do not exceed; 1 if none is above 0.
fn percentile(values: impl Iterator<Item = f32>) -> f32 {
    let mut values: Vec<f32> = values.filter(|value| value.is_finite() && *value > 0.0).collect();
    values.sort_by(f32::total_cmp);
    let rank = (values.len() as f64 * WITHIN).ceil() as usize;
    values.get(rank.saturating_sub(1)).copied().unwrap_or(1.0)
}

/// Two digits.
fn short(value: f32) -> String {
    if value >= 10.0 {
        format!("{value:.0}")
    } else if value >= 0.1 {
        format!("{value:.2}")
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(name: &str, samples: &[f32]) -> Image {
        Image::from_plane(samples.len(), 1, name, samples.to_vec()).unwrap()
    }

    #[test]
    fn radiance_is_srgb() {
        let image = tone(&plane("Y", &[0.0, 0.2140, 1.0, 7.0]), 0.0).image;
        let codes: Vec<u8> = image.pixels().map(|pixel| pixel.0[0]).collect();
        assert_eq!(codes, [0, 127, 255, 255]);
        assert_eq!(tone(&plane("Y", &[0.1070]), 1.0).image.get_pixel(0, 0).0, [127; 3]);
    }

    #[test]
    fn differences_are_around_grey() {
        let toned = tone(&plane("Y", &[-0.5, 0.0, 0.25, f32::NAN]), 0.0);
        let codes: Vec<[u8; 3]> = toned.image.pixels().map(|pixel| pixel.0).collect();
        assert_eq!(codes, [[0; 3], [128; 3], [191; 3], NOTHING]);
        assert_eq!(toned.note.unwrap(), "±0.50");
    }

    #[test]
    fn near_is_lighter_than_far_and_no_depth_is_neither() {
        let toned = tone(&plane("Z", &[0.5, 1.0, 2.0, 0.0, f32::INFINITY]), 0.0);
        let light = |x: u32| toned.image.get_pixel(x, 0).0.iter().map(|code| u32::from(*code)).sum::<u32>();
        assert!(light(0) > light(1) && light(1) > light(2));
        assert_eq!(toned.image.get_pixel(3, 0).0, NOTHING);
        assert_eq!(toned.image.get_pixel(4, 0).0, NOTHING);
        assert_eq!(toned.note.unwrap(), "0.50–2.00 m");
    }
}
