//! A file, its value, and the way back into the file.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use crate::error::Error;
use crate::key_path::KeyPath;
use crate::limits::{MAX_FILE_BYTES, read_text};
use crate::problem::{Problem, Problems};
use crate::schema::Schema;
use crate::schema::check::check;
use crate::source::Source;
use crate::tree::{Node, Parsed};

/// A TOML file that was read: its value, and where everything stands in it.
///
/// Crates that know more than types can say report what they find with [`Document::error_at`].
#[derive(Debug)]
pub struct Document<T> {
    pub(crate) source: Source,
    pub(crate) value: T,
    root: Node,
}

impl<T: DeserializeOwned + JsonSchema> Document<T> {
    /// Reads and checks a file. All problems are reported at once, see [`Error::Invalid`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        Self::parse(&read_text(path)?, path)
    }

    /// Checks a text; `path` is the file that messages name.
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        if text.len() as u64 > MAX_FILE_BYTES {
            return Err(Error::TooLarge {
                path: path.to_path_buf(),
            });
        }
        let source = Source::new(path, text);
        let (value, root) = checked(&source).map_err(invalid)?;
        Ok(Self { source, value, root })
    }
}

/// Text to value: syntax, then the schema, then serde for what only the types' own code can judge.
fn checked<T: DeserializeOwned + JsonSchema>(source: &Source) -> Result<(T, Node), Vec<Problem>> {
    let parsed = Parsed::new(source)?;
    let problems = check(&Schema::of::<T>(), &parsed.root, source);
    if !problems.is_empty() {
        return Err(problems);
    }
    parsed.deserialize(source).map_err(|problem| vec![problem])
}

fn invalid(problems: Vec<Problem>) -> Error {
    Error::Invalid(Problems::sorted(problems))
}

impl<T> Document<T> {
    /// What the file says.
    pub fn value(&self) -> &T {
        &self.value
    }

    /// What the file says, without the file.
    pub fn into_value(self) -> T {
        self.value
    }

    /// The file.
    pub fn path(&self) -> PathBuf {
        self.source.path()
    }

    /// The text as it was read or last saved.
    pub fn text(&self) -> &str {
        self.source.text()
    }

    /// A problem with the value of a key, with its line and column. `key` is a [`KeyPath`] or a list of steps:
    /// `&["camera", "size_px"]`, `&["thing", "2", "name"]`. Where the file lacks the key, the place is that of the
    /// nearest thing around it. An empty `help` is left out.
    pub fn error_at(
        &self,
        key: impl Into<KeyPath>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Problem {
        let key = key.into();
        let span = self.root.find(&key).span;
        Problem::new(&self.source, span, &key, message.into()).with_help(help)
    }

    /// As [`Document::error_at`], but the place is the key itself instead of its value.
    pub fn error_at_key(
        &self,
        key: impl Into<KeyPath>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Problem {
        let key = key.into();
        let span = self.root.find(&key).key_span;
        Problem::new(&self.source, span, &key, message.into()).with_help(help)
    }

    /// True if the file itself has the key, rather than its default.
    pub fn contains(&self, key: impl Into<KeyPath>) -> bool {
        self.root.contains(&key.into())
    }

    /// `Err` with all of `problems` if one of them is an error.
    pub fn reject(problems: Vec<Problem>) -> Result<Vec<Problem>, Error> {
        match problems.iter().any(Problem::is_error) {
            true => Err(invalid(problems)),
            false => Ok(problems),
        }
    }
}
