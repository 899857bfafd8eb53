//! A file, its value, and the way back into the file.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use toml_edit::{DocumentMut, InlineTable, TomlError};

use crate::error::Error;
use crate::key_path::KeyPath;
use crate::limits::{MAX_FILE_BYTES, read_text};
use crate::problem::{Problem, Problems};
use crate::schema::Schema;
use crate::schema::check::check;
use crate::source::{BYTE_ORDER_MARK, Source};
use crate::tree::{Node, Parsed};
use crate::write;

/// A TOML file that was read: its value, and where everything stands in it.
///
/// Crates that know more than types can say report what they find with [`Document::error_at`].
#[derive(Clone, Debug)]
pub struct Document<T> {
    source: Source,
    value: T,
    root: Node,
    /// What the file contained when it was read or saved; `None` if it was not a file.
    on_disk: Option<String>,
}

impl<T: DeserializeOwned + JsonSchema> Document<T> {
    /// Reads and checks a file. All problems are reported at once, see [`Error::Invalid`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let text = read_text(path)?;
        let mut document = Self::parse(&text, path)?;
        document.on_disk = Some(text);
        Ok(document)
    }

    /// Checks a text; `path` is the file that messages name.
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        if text.len() as u64 > MAX_FILE_BYTES {
            return Err(Error::TooLarge { path: path.to_path_buf() });
        }
        let source = Source::new(path, text);
        let (value, root) = checked(&source).map_err(invalid)?;
        Ok(Self { source, value, root, on_disk: None })
    }
}

impl<T: Serialize + DeserializeOwned + JsonSchema> Document<T> {
    /// A new file of a value; nothing is written before [`Document::save`].
    ///
    /// # Errors
    /// [`Error::Unwritable`] if the value would not be read back as it is, for example a NaN.
    pub fn new(value: &T, path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let plain = write::plain(value).map_err(|message| unwritable(path, message))?;
        Self::parse_back(&write::fresh_text(&plain), path, &plain)
    }

    /// Takes over a changed value. In the text only what differs is touched: comments, order and formatting of all
    /// other keys stay, keys that were left to their defaults stay away. New keys follow their neighbour in the type;
    /// a key that is gone takes the comment above it along. Nothing is written before [`Document::save`].
    ///
    /// # Errors
    /// [`Error::Unwritable`] if the value would not be read back as it is, for example a NaN; the document is then as
    /// before.
    pub fn set(&mut self, value: &T) -> Result<(), Error> {
        let path = self.path();
        let unwritable = |message| unwritable(&path, message);
        let old = write::plain(&self.value).map_err(unwritable)?;
        let new = write::plain(value).map_err(unwritable)?;
        if write::same_table(&old, &new) {
            return Ok(());
        }
        let mut document: DocumentMut =
            self.text().parse().map_err(|error: TomlError| unwritable(error.to_string()))?;
        write::merge(&mut document, &old, &new);
        let text = with_line_ends_of(self.text(), &document.to_string());
        let merged = Self::parse_back(&text, &path, &new)?;
        *self = Self { on_disk: self.on_disk.take(), ..merged };
        Ok(())
    }

    /// Reads what would be written: a file that means something else never reaches the disk.
    fn parse_back(text: &str, path: &Path, meant: &InlineTable) -> Result<Self, Error> {
        let document = Self::parse(text, path).map_err(|error| unwritable(path, error.to_string()))?;
        let read = write::plain(&document.value).map_err(|message| unwritable(path, message))?;
        match write::same_table(&read, meant) {
            true => Ok(document),
            false => Err(unwritable(path, "reading it back gives another value".to_owned())),
        }
    }
}

fn unwritable(path: &Path, message: String) -> Error {
    Error::Unwritable { path: path.to_path_buf(), message }
}

/// The writer ends lines with a line feed and drops a byte order mark.
fn with_line_ends_of(original: &str, text: &str) -> String {
    let text = text.replace("\r\n", "\n");
    let text = if original.contains("\r\n") { text.replace('\n', "\r\n") } else { text };
    match original.starts_with(BYTE_ORDER_MARK) && !text.starts_with(BYTE_ORDER_MARK) {
        true => format!("{BYTE_ORDER_MARK}{text}"),
        false => text,
    }
}

/// Text to value: syntax, then the schema, then serde for what only the types' own code can judge.
fn checked<T: DeserializeOwned + JsonSchema>(source: &Source) -> Result<(T, Node), Vec<Problem>> {
    let parsed = Parsed::new(source)?;
    let problems = check(&Schema::of::<T>(), &parsed.root, source);
    if !problems.is_empty() {
        return Err(problems);
    }
    parsed.deserialize(source)
}

fn invalid(problems: Vec<Problem>) -> Error {
    Error::Invalid(Problems::sorted(problems))
}

impl<T> Document<T> {
    /// Writes the text to the file it came from, whole or not at all; does nothing if it is there already.
    ///
    /// # Errors
    /// [`Error::ChangedOnDisk`] if the file is not as it was read; then nothing is written.
    pub fn save(&mut self) -> Result<(), Error> {
        let path = self.path();
        if let Some(known) = &self.on_disk {
            let found = read_text(&path).ok();
            if found.as_deref() == Some(self.text()) {
                return Ok(());
            }
            if found.is_some_and(|found| found != *known) {
                return Err(Error::ChangedOnDisk { path });
            }
        }
        self.write_to(&path)?;
        self.on_disk = Some(self.text().to_owned());
        Ok(())
    }

    /// Writes the text to another file, whole or not at all, and keeps to that file from now on.
    pub fn save_as(&mut self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        self.write_to(path)?;
        self.source = Source::new(path, self.text());
        self.on_disk = Some(self.text().to_owned());
        Ok(())
    }

    fn write_to(&self, path: &Path) -> Result<(), Error> {
        write::save(path, self.text()).map_err(|source| Error::Write { path: path.to_path_buf(), source })
    }

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
