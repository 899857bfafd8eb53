//! Which files a path, folder or pattern names.

use std::path::{Path, PathBuf};

use super::natural;

const EXTENSIONS: [&str; 8] = ["png", "jpg", "jpeg", "pgm", "ppm", "pnm", "exr", "hdr"];

/// Whether the name ends like that of an image this crate reads.
pub(super) fn is_image(path: &Path) -> bool {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
    extension.is_some_and(|extension| EXTENSIONS.contains(&extension.as_str()))
}

/// The files in natural order: the file itself, the images of a folder, or what a glob pattern matches.
///
/// # Errors
/// A sentence that says what is wrong with `pattern`.
pub(super) fn list(pattern: &str) -> Result<Vec<PathBuf>, String> {
    if pattern.is_empty() {
        return Err("names no file: write images:FILE, images:FOLDER or images:PATTERN".into());
    }
    let path = Path::new(pattern);
    let mut files = if path.is_file() {
        vec![path.to_owned()]
    } else if path.is_dir() {
        images_in(path).map_err(|error| format!("the folder cannot be read: {error}"))?
    } else if pattern.contains(['*', '?', '[']) {
        matches(pattern)?
    } else {
        return Err("no such file or folder".into());
    };
    sort(&mut files);
    match files.is_empty() {
        true => Err(format!("no images ({}) there", EXTENSIONS.join(", "))),
        false => Ok(files),
    }
}

/// The images of a folder, in no order.
pub(super) fn images_in(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if is_image(&path) && path.is_file() {
            files.push(path);
        }
    }
    Ok(files)
}

/// Sorts as people would.
pub(super) fn sort(files: &mut [PathBuf]) {
    files.sort_by(|a, b| natural::compare(&a.to_string_lossy(), &b.to_string_lossy()));
}

fn matches(pattern: &str) -> Result<Vec<PathBuf>, String> {
    let paths = glob::glob(pattern).map_err(|error| format!("the pattern is wrong: {error}"))?;
    let mut files = Vec::new();
    for path in paths {
        let path =
            path.map_err(|error| format!("{} cannot be read: {}", error.path().display(), error.error()))?;
        if path.is_file() {
            files.push(path);
        }
    }
    Ok(files)
}
