//! Why a file could not be read or written.

use std::io;
use std::path::PathBuf;

use crate::limits::MAX_FILE_BYTES;
use crate::problem::{Problem, Problems};

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file cannot be opened or read.
    #[error("{}: cannot read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Reason given by the system.
        source: io::Error,
    },
    /// A folder, pipe or device.
    #[error("{}: not a regular file", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// Larger than any file of this project.
    #[error("{}: larger than {} MiB, the most that is read as TOML", path.display(), MAX_FILE_BYTES >> 20)]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// Text that is not UTF-8.
    #[error("{}:{line}:{column}: not UTF-8 text (TOML files must be)", path.display())]
    NotUtf8 {
        /// The file.
        path: PathBuf,
        /// Line of the first wrong byte, from 1.
        line: usize,
        /// Column of the first wrong byte in characters, from 1.
        column: usize,
    },
    /// Problems with the content.
    #[error("{0}")]
    Invalid(Problems),
    /// The file cannot be written.
    #[error("{}: cannot write: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Reason given by the system.
        source: io::Error,
    },
    /// Somebody else wrote the file since it was read.
    #[error("{}: changed by another program since it was read; not overwritten", path.display())]
    ChangedOnDisk {
        /// The file.
        path: PathBuf,
    },
    /// A value that TOML or the file's own type cannot express, such as NaN.
    #[error("{}: value cannot be written: {message}", path.display())]
    Unwritable {
        /// The file it was meant for.
        path: PathBuf,
        /// Why not.
        message: String,
    },
}

impl Error {
    /// The problems with the content; empty for other errors.
    pub fn problems(&self) -> &[Problem] {
        match self {
            Self::Invalid(problems) => problems.list(),
            _ => &[],
        }
    }
}
