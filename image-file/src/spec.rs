use std::fmt;
use std::path::{Path, PathBuf};

use super::{Image, ImageError, LayeredImage, read};

/// A file and maybe a layer of it, written `file.exr#layer`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageSpec {
    /// The file.
    pub path: PathBuf,
    /// The layer (`real`), or one channel (`real.R`, `Z`), if one was named.
    pub layer: Option<String>,
}

impl ImageSpec {
    /// Splits at the last `#`, unless a file of the whole name exists.
    pub fn parse(text: &str) -> Self {
        let whole = Path::new(text);
        match text.rsplit_once('#') {
            Some((path, layer)) if !path.is_empty() && !layer.is_empty() && !whole.exists() => {
                Self { path: path.into(), layer: Some(layer.into()) }
            }
            _ => Self { path: whole.into(), layer: None },
        }
    }

    /// Picks this spec's image out of what its file holds.
    ///
    /// Without a layer's name: the only layer, or the unnamed one.
    ///
    /// # Errors
    /// [`ImageError::Layer`] naming what there is.
    pub fn select(&self, file: &LayeredImage) -> Result<Image, ImageError> {
        match &self.layer {
            Some(name) => file
                .layer(name)
                .cloned()
                .or_else(|| single_channel(file, name))
                .ok_or_else(|| self.no_layer(file, format!("no layer {name:?}"))),
            None => match (file.layers.as_slice(), file.layer("")) {
                ([only], _) => Ok(only.image.clone()),
                (_, Some(unnamed)) => Ok(unnamed.clone()),
                _ => Err(self.no_layer(file, "name a layer, as in file.exr#layer".into())),
            },
        }
    }

    fn no_layer(&self, file: &LayeredImage, problem: String) -> ImageError {
        let describe = |layer: &super::Layer| {
            let name = if layer.name.is_empty() { "(unnamed)" } else { &layer.name };
            format!("{name} [{}]", layer.image.channel_names().join(" "))
        };
        let available = file.layers.iter().map(describe).collect::<Vec<_>>().join(", ");
        ImageError::Layer { path: self.path.clone(), problem, available }
    }
}

/// `real.R` is the channel `R` of layer `real`; `Z` that of the unnamed layer.
fn single_channel(file: &LayeredImage, name: &str) -> Option<Image> {
    let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
    let image = file.layer(layer)?;
    let samples = image.channel(channel)?.to_vec();
    let picked = Image::from_plane(image.width(), image.height(), channel, samples).ok()?;
    Some(match image.window() {
        Some(window) => picked.with_window(window),
        None => picked,
    })
}

impl fmt::Display for ImageSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        match &self.layer {
            Some(layer) => write!(f, "#{layer}"),
            None => Ok(()),
        }
    }
}

/// Reads the image a spec names, with the notes of its file.
///
/// # Errors
/// As [`read`] and [`ImageSpec::select`].
pub fn read_spec(spec: &ImageSpec) -> Result<(Image, Vec<String>), ImageError> {
    let file = read(&spec.path)?;
    Ok((spec.select(&file)?, file.notes))
}
