//! Image files as tiles.

use coshade_image_file::{ImageSpec, read_spec};

use super::{Tile, tone};

/// The picture that `text` names, `file` or `file.exr#layer`.
///
/// # Errors
/// Name the file, and the layers there are.
pub fn tile(text: &str, exposure_ev: f32) -> anyhow::Result<Tile> {
    let spec = ImageSpec::parse(text);
    let (image, _) = read_spec(&spec)?;
    let tone::Toned { image, note } = tone::tone(&image, exposure_ev);
    let file = spec.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let name = match &spec.layer {
        Some(layer) => format!("{file} {layer}"),
        None => file,
    };
    Ok(Tile { image, label: note.map_or(name.clone(), |note| format!("{name} {note}")) })
}
