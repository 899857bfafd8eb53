//! What a file is, by its first bytes where they tell, else by its name and keys.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, bail};
use serde::Serialize;

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A folder of images.
    Folder,
    /// MCAP or ROS 1 bag.
    Recording,
    /// glTF, OBJ or PLY.
    Mesh,
    /// EXR, HDR, PNG or JPEG.
    Image,
    /// PGM or PPM.
    DepthImage,
    /// Calibration of a camera.
    Calibration,
    /// A session.
    Session,
    /// Where the sensors of a rig sit.
    Rig,
    /// A printed board of tags.
    Board,
    /// A world to be simulated.
    World,
}

impl Kind {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Folder => "folder of images",
            Self::Recording => "recording",
            Self::Mesh => "mesh",
            Self::Image => "image",
            Self::DepthImage => "portable anymap image",
            Self::Calibration => "camera calibration",
            Self::Session => "session",
            Self::Rig => "rig",
            Self::Board => "board of tags",
            Self::World => "simulated world",
        }
    }
}

/// The kind of `path`.
pub fn of(path: &Path) -> anyhow::Result<Kind> {
    let about = std::fs::metadata(path).with_context(|| format!("{}", path.display()))?;
    if about.is_dir() {
        return Ok(Kind::Folder);
    }
    if !about.is_file() {
        bail!("{}: not a regular file or folder", path.display());
    }
    let mut head = Vec::new();
    File::open(path)
        .and_then(|file| file.take(64).read_to_end(&mut head))
        .with_context(|| format!("{}", path.display()))?;
    if let Some(kind) = by_first_bytes(&head) {
        return Ok(kind);
    }
    match by_ending(path) {
        Some(Kind::Session) => by_keys(path),
        Some(kind) => Ok(kind),
        None => bail!(
            "{}: not a kind of file that coshade knows (recordings .mcap .bag, settings .toml, meshes .glb .gltf .obj \
             .ply, images .exr .hdr .png .jpg .jpeg .pgm .ppm){}",
            path.display(),
            advice(path)
        ),
    }
}

/// What the name says; [`Kind::Session`] for any TOML file.
pub fn by_ending(path: &Path) -> Option<Kind> {
    let ending = path.extension()?.to_string_lossy().to_ascii_lowercase();
    match ending.as_str() {
        "mcap" | "bag" => Some(Kind::Recording),
        "glb" | "gltf" | "obj" | "ply" => Some(Kind::Mesh),
        "exr" | "hdr" | "png" | "jpg" | "jpeg" => Some(Kind::Image),
        "pgm" | "ppm" | "pnm" => Some(Kind::DepthImage),
        "toml" => Some(Kind::Session),
        _ => None,
    }
}

/// What to do with files in which other programs keep calibrations and poses.
fn advice(path: &Path) -> &'static str {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match ending.as_str() {
        "yaml" | "yml" | "json" | "xml" => {
            "; a calibration of OpenCV or Kalibr goes into a .toml, number by number, in the same order"
        }
        "txt" => "; a list of an RGB-D data set is read with the folder that holds it",
        _ => "",
    }
}

fn by_first_bytes(head: &[u8]) -> Option<Kind> {
    let kinds: [(&[u8], Kind); 9] = [
        (b"\x89MCAP0\r\n", Kind::Recording),
        (b"#ROSBAG", Kind::Recording),
        (b"glTF", Kind::Mesh),
        (b"ply\n", Kind::Mesh),
        (b"ply\r\n", Kind::Mesh),
        (b"\x76\x2f\x31\x01", Kind::Image),
        (b"#?", Kind::Image),
        (b"\x89PNG", Kind::Image),
        (b"\xff\xd8\xff", Kind::Image),
    ];
    kinds.iter().find(|(magic, _)| head.starts_with(magic)).map(|&(_, kind)| kind)
}

/// Which of the TOML files it is, by keys that only one kind has. A file with none of them is taken for a session,
/// whose reader then names what it does not know.
fn by_keys(path: &Path) -> anyhow::Result<Kind> {
    if std::fs::metadata(path)?.len() > coshade_config::MAX_FILE_BYTES {
        bail!("{}: larger than {} MiB", path.display(), coshade_config::MAX_FILE_BYTES >> 20);
    }
    let bytes = std::fs::read(path).with_context(|| format!("{}", path.display()))?;
    let text = String::from_utf8_lossy(&bytes);
    let keys = top_level_keys(&text);
    let has = |names: &[&str]| names.iter().any(|name| keys.contains(name));
    Ok(match () {
        () if has(&["lens", "size_px", "response", "vignetting"]) => Kind::Calibration,
        () if has(&["keyframe", "trace"]) => Kind::World,
        () if has(&["tag", "family"]) => Kind::Board,
        () if has(&["sensor"]) => Kind::Rig,
        () => Kind::Session,
    })
}

/// Keys and tables of the first level, also of a text that is no valid TOML: its errors should be those of its kind.
fn top_level_keys(text: &str) -> Vec<&str> {
    let mut in_root = true;
    let mut keys = Vec::new();
    for line in text.lines().map(str::trim_start).filter(|line| !line.starts_with('#')) {
        if let Some(header) = line.strip_prefix('[') {
            in_root = false;
            keys.extend(header.trim_start_matches('[').split(['.', ']']).next().map(str::trim));
        } else if in_root && let Some((key, _)) = line.split_once('=') {
            keys.extend(key.split('.').next().map(str::trim));
        }
    }
    keys
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_keys_of_the_first_level_tell_what_a_file_is() {
        let text = "version = 1\n# lens = 2\n[camera]\nsource = 'x'\n[camera.controls]\nsize_px = [4, 3]\n[[thing]]\n";
        assert_eq!(top_level_keys(text), ["version", "camera", "camera", "thing"]);
    }
}
