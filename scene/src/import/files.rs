//! Files, and the files they refer to.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use super::error::Fault;

/// Largest file that is read, bytes.
const MAX_FILE_BYTES: u64 = 1 << 30;

/// The whole file. Devices and pipes are refused, they may have no end.
pub(super) fn read_limited(path: &Path) -> io::Result<Vec<u8>> {
    // Asked before opening: opening a pipe waits for a writer.
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    let too_large = || {
        let text = format!("larger than {} MiB, the most an import reads", MAX_FILE_BYTES >> 20);
        io::Error::new(io::ErrorKind::FileTooLarge, text)
    };
    if metadata.len() > MAX_FILE_BYTES {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(too_large());
    }
    Ok(bytes)
}

/// A file that another one refers to by a path relative to its own folder.
pub(super) fn read_beside(folder: &Path, relative: &str, place: &str) -> Result<Vec<u8>, Fault> {
    let path = folder.join(inside(relative, place)?);
    read_limited(&path)
        .map_err(|error| Fault::new(place, format!("cannot read '{}': {error}", path.display())))
}

/// Refuses what leaves the folder: absolute paths, drive letters, `..` beyond the start.
pub(super) fn inside(relative: &str, place: &str) -> Result<PathBuf, Fault> {
    let refuse = |why| {
        Err(Fault::new(
            place,
            format!("refers to '{relative}', {why}; only files in the folder of this file or below are read"),
        ))
    };
    if relative.is_empty() || relative.contains('\0') {
        return refuse("which is no file name");
    }
    // Files written on Windows have backslashes.
    let slashed = relative.replace('\\', "/");
    if slashed.split('/').next().is_some_and(|first| first.contains(':')) {
        return refuse("which has a scheme or a drive");
    }
    let mut path = PathBuf::new();
    for component in Path::new(&slashed).components() {
        match component {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            Component::ParentDir => return refuse("which leaves the folder"),
            Component::RootDir | Component::Prefix(_) => return refuse("which is an absolute path"),
        }
    }
    Ok(path)
}

/// Decodes `%20` and the like (RFC 3986).
pub(super) fn percent_decoded(uri: &str, place: &str) -> Result<String, Fault> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let mut digit = || rest.next().and_then(|digit| char::from(digit).to_digit(16));
        let (Some(high), Some(low)) = (digit(), digit()) else {
            return Err(Fault::new(place, format!("URI '{uri}' has a '%' without two hexadecimal digits")));
        };
        bytes.push((high * 16 + low) as u8);
    }
    String::from_utf8(bytes).map_err(|_| Fault::new(place, format!("URI '{uri}' is not UTF-8")))
}
