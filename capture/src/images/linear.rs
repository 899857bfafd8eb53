//! EXR and Radiance HDR files as frames of linear light.

use std::path::Path;

use coshade_image_file::{Image, ImageError, LayerOutline, ReadLimits, outline, read_bytes};

use super::read::MAX_COMPRESSION;
use crate::frame::MAX_SIZE_PX;

/// Decoded samples that any file may have.
const SMALL_BYTES: u64 = 48 << 20;

/// The layer to be played of the file that begins with `bytes`: `wanted`, else the only or the unnamed one.
///
/// # Errors
/// A sentence that says what is wrong with the file or its layers, and what to do.
pub(super) fn layer(bytes: &[u8], wanted: Option<&str>) -> Result<LayerOutline, String> {
    let limits = ReadLimits { max_side_px: MAX_SIZE_PX as usize, ..ReadLimits::default() };
    let layers = outline(Path::new(""), bytes, &limits).map_err(|error| error.reason())?;
    let layer = choose(&layers, wanted)?;
    if !is_colour(layer) && !is_grey(layer) {
        let found = layer.channels.join(" ");
        return Err(format!("{} has channels {found}, a picture has R G B or Y", name(layer)));
    }
    check_window(layer)?;
    Ok(layer.clone())
}

fn choose<'a>(layers: &'a [LayerOutline], wanted: Option<&str>) -> Result<&'a LayerOutline, String> {
    let named = |name: &str| layers.iter().find(|layer| layer.name == name);
    let (found, problem) = match (wanted, layers) {
        (Some(name), _) => (named(name), format!("there is no layer `{name}`")),
        (None, [only]) => (Some(only), String::new()),
        (None, _) => (named(""), "there are several layers".into()),
    };
    found.ok_or_else(|| {
        let pictures = layers.iter().filter(|layer| is_colour(layer) || is_grey(layer));
        let names: Vec<&str> =
            pictures.map(|layer| layer.name.as_str()).filter(|name| !name.is_empty()).collect();
        match names.as_slice() {
            [] => format!("{problem}, and none with a name that is a picture: leave out `layer`"),
            names => format!("{problem}: add layer=NAME, where NAME is one of {}", names.join(", ")),
        }
    })
}

fn name(layer: &LayerOutline) -> String {
    if layer.name.is_empty() { "the image".into() } else { format!("layer `{}`", layer.name) }
}

fn has(layer: &LayerOutline, channel: &str) -> bool {
    layer.channels.iter().any(|name| name == channel)
}

fn is_colour(layer: &LayerOutline) -> bool {
    ["R", "G", "B"].iter().all(|channel| has(layer, channel))
}

/// Luminance; beside X it is a coordinate.
fn is_grey(layer: &LayerOutline) -> bool {
    has(layer, "Y") && !has(layer, "X")
}

/// A calibration holds for the whole raster: a part of it would be taken for the whole.
fn check_window(layer: &LayerOutline) -> Result<(), String> {
    let Some(window) = layer.window else { return Ok(()) };
    let [width, height] = window.display_size_px;
    if window.data_origin_px == window.display_origin_px && [layer.width, layer.height] == [width, height] {
        return Ok(());
    }
    let [x, y] = [0, 1].map(|axis: usize| {
        i64::from(window.data_origin_px[axis]) - i64::from(window.display_origin_px[axis])
    });
    Err(format!(
        "the data window ({} x {} pixels at ({x}, {y})) is not the display window ({width} x {height}): save the image \
         whole, for instance with oiiotool --croptofull",
        layer.width, layer.height
    ))
}

/// What a file holds: the picture of `layer`, and what its header says that is not applied.
///
/// # Errors
/// A sentence that says what is wrong with the file.
pub(super) fn read(bytes: &[u8], layer: &LayerOutline) -> Result<(Image, Vec<String>), String> {
    let default = ReadLimits::default();
    // Samples of 16 bits become 32.
    let packed_bytes = (bytes.len() as u64).saturating_mul(2 * MAX_COMPRESSION);
    let max_decoded_bytes = packed_bytes.saturating_add(SMALL_BYTES).min(default.max_decoded_bytes);
    let limits = ReadLimits { max_decoded_bytes, max_side_px: MAX_SIZE_PX as usize };
    let reason = |error: ImageError| error.reason();
    let file = read_bytes(Path::new(""), bytes, &limits).map_err(reason)?;
    let single = file.layers.len() == 1;
    let image = file.layers.into_iter().find(|found| found.name == layer.name);
    let image = image.ok_or_else(|| format!("{} is missing", name(layer)))?.image;
    // Notes on the samples of other layers are none on this picture.
    Ok((image, if single { file.notes } else { Vec::new() }))
}

/// Writes red, green and blue (or the one grey) of every pixel as a linear frame has them.
pub(super) fn pack(image: &Image, pixels: &mut [u8]) -> Result<(), String> {
    let grey = || image.channel("Y").map(|plane| [plane; 3]);
    let [red, green, blue] = image.rgb().or_else(grey).ok_or("no picture")?;
    let values = red.iter().zip(green).zip(blue);
    for (out, ((red, green), blue)) in
        pixels.as_chunks_mut::<4>().0.as_chunks_mut::<3>().0.iter_mut().zip(values)
    {
        *out = [red, green, blue].map(|value| value.to_le_bytes());
    }
    Ok(())
}
