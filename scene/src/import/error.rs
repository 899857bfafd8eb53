//! Why a file could not be read.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a mesh could not be imported.
#[derive(Debug, Error)]
pub enum ImportError {
    /// The file itself cannot be read, or is larger than an import may be.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Not a format this program reads.
    #[error("{}: unknown ending '{ending}', expected .glb, .gltf, .obj or .ply", file.display())]
    Ending {
        /// The file.
        file: PathBuf,
        /// Its ending, in lower case.
        ending: String,
    },
    /// Something in the file, or in a file it refers to, is wrong or not supported.
    #[error("{}: {place}: {problem}", file.display())]
    Content {
        /// The file.
        file: PathBuf,
        /// Where in it, such as `accessors[3]` or `line 12`.
        place: String,
        /// What is wrong there.
        problem: String,
    },
}

/// A wrong place, before the file's name is known.
#[derive(Debug)]
pub(super) struct Fault {
    pub place: String,
    pub problem: String,
}

impl Fault {
    pub fn new(place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { place: place.into(), problem: problem.into() }
    }

    pub fn in_file(self, file: &Path) -> ImportError {
        ImportError::Content { file: file.to_owned(), place: self.place, problem: self.problem }
    }
}
