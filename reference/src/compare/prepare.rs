use rayon::prelude::*;

use super::display::DisplayTransform;
use super::plane::Grid;
use super::{CompareError, Named};
use coshade_image_file::{ColourKind, Image};

/// Two images checked to fit each other: their compared planes and which pixels count.
pub(super) struct Prepared<'a> {
    pub grid: Grid,
    pub names: Vec<String>,
    pub a: Vec<&'a [f32]>,
    pub b: Vec<&'a [f32]>,
    /// Finite in every compared channel of both.
    pub valid: Vec<bool>,
    /// Code values; `None` for layers of data.
    pub display: Option<DisplayPlanes>,
    pub notes: Vec<String>,
}

/// Code values in [0, 1]; black in both images where a pixel does not count.
pub(super) struct DisplayPlanes {
    pub a: Vec<Vec<f32>>,
    pub b: Vec<Vec<f32>>,
}

pub(super) fn prepare<'a>(
    a: Named<'a>,
    b: Named<'a>,
    display: &DisplayTransform,
) -> Result<Prepared<'a>, CompareError> {
    check_sizes(a, b)?;
    let (names, is_colour, notes) = common_channels(a, b)?;
    let planes = |image: &'a Image| -> Vec<&'a [f32]> {
        names.iter().filter_map(|name| image.channel(name)).collect()
    };
    let (planes_a, planes_b) = (planes(a.image), planes(b.image));
    let grid = Grid { width: a.image.width(), height: a.image.height() };
    let finite = |i: usize| planes_a.iter().chain(&planes_b).all(|plane| plane[i].is_finite());
    let valid: Vec<bool> = (0..grid.pixels()).into_par_iter().map(finite).collect();
    let display = match is_colour {
        true => Some(DisplayPlanes {
            a: encode(&planes_a, &valid, display)?,
            b: encode(&planes_b, &valid, display)?,
        }),
        false => None,
    };
    Ok(Prepared { grid, names, a: planes_a, b: planes_b, valid, display, notes })
}

fn check_sizes(a: Named<'_>, b: Named<'_>) -> Result<(), CompareError> {
    let size = |image: &Image| [image.width(), image.height()];
    if size(a.image) != size(b.image) {
        return Err(CompareError::Size {
            a: a.name.into(),
            a_px: size(a.image),
            b: b.name.into(),
            b_px: size(b.image),
        });
    }
    match (a.image.window(), b.image.window()) {
        (Some(window_a), Some(window_b)) if window_a.data_origin_px != window_b.data_origin_px => {
            Err(CompareError::Window {
                a: a.name.into(),
                a_origin_px: window_a.data_origin_px,
                b: b.name.into(),
                b_origin_px: window_b.data_origin_px,
            })
        }
        _ => Ok(()),
    }
}

/// The channels to compare, whether they are colour, and what is left out. Alpha is left out of colour images, and
/// so is depth stored beside colour.
fn common_channels(a: Named<'_>, b: Named<'_>) -> Result<(Vec<String>, bool, Vec<String>), CompareError> {
    let mismatch = || CompareError::Channels {
        a: a.name.into(),
        a_channels: a.image.channel_names().join(" "),
        b: b.name.into(),
        b_channels: b.image.channel_names().join(" "),
    };
    let kind = a.image.colour_kind();
    if kind != b.image.colour_kind() {
        return Err(mismatch());
    }
    let compared: Vec<&str> = match kind {
        ColourKind::Rgb => vec!["R", "G", "B"],
        ColourKind::Grey => vec!["Y"],
        ColourKind::Data => a.image.channel_names(),
    };
    if kind == ColourKind::Data && compared != b.image.channel_names() {
        return Err(mismatch());
    }
    let mut notes = Vec::new();
    for named in [a, b] {
        let left_out: Vec<&str> =
            named.image.channel_names().into_iter().filter(|name| !compared.contains(name)).collect();
        if !left_out.is_empty() {
            notes.push(format!("{}: channels not compared: {}", named.name, left_out.join(" ")));
        }
    }
    let compared = compared.into_iter().map(String::from).collect();
    Ok((compared, kind != ColourKind::Data, notes))
}

fn encode(
    planes: &[&[f32]],
    valid: &[bool],
    display: &DisplayTransform,
) -> Result<Vec<Vec<f32>>, CompareError> {
    let encode_plane = |(channel, plane): (usize, &&[f32])| {
        let code = |(&radiance, &valid): (&f32, &bool)| {
            let code = if valid { display.code(channel, radiance) } else { 0.0 };
            if code.is_nan() { Err(CompareError::Response { channel, radiance }) } else { Ok(code) }
        };
        plane.par_iter().zip(valid).map(code).collect()
    };
    planes.iter().enumerate().map(encode_plane).collect()
}
