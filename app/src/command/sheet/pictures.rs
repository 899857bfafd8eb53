//! Image files as tiles.

use std::path::Path;

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
    let file = short_name(&spec.path);
    let name = match &spec.layer {
        Some(layer) => format!("{file} {layer}"),
        None => file,
    };
    Ok(Tile { image, label: note.map_or(name.clone(), |note| format!("{name} {note}")) })
}

/// The file and its folder: pictures of one kind often have the same name.
fn short_name(path: &Path) -> String {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match path.parent().map(name).filter(|folder| !folder.is_empty()) {
        Some(folder) => format!("{folder}/{}", name(path)),
        None => name(path),
    }
}
