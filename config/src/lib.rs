//! TOML files as the project reads and writes them.
//!
//! - Strict: an unknown key is an error that names file, line, column, the whole path of the key and the nearest known
//!   one. All problems of a file are reported together.
//! - One source of truth: the types. `serde` reads them; the checker and the reference page use the schema that
//!   `schemars` derives from the same docstrings, types, defaults and ranges (`#[schemars(range(min = 0.0))]`,
//!   `#[schemars(extend("exclusiveMinimum" = 0))]`, `#[schemars(length(min = 1))]`).
//! - Comments survive: [`Document::save`] writes only what changed.
//!
//! Numbers are finite: `nan`, `inf` and numbers beyond their type are errors. `#[serde(alias)]` is not part of a
//! schema, so an alias is an unknown key.
//!
//! ```
//! #[derive(serde::Deserialize, schemars::JsonSchema)]
//! struct Lamp {
//!     /// Of the disc, metres.
//!     #[schemars(range(min = 0.0))]
//!     radius_m: f64,
//! }
//!
//! let error = coshade_config::parse::<Lamp>("radius = 0.005", "lamp.toml").err().unwrap();
//! assert_eq!(
//!     error.to_string(),
//!     "lamp.toml:1:1: error: radius: unknown key\n  |\n1 | radius = 0.005\n  | ^^^^^^\n  = did you mean `radius_m`?"
//! );
//! ```

mod document;
mod error;
mod key_path;
mod limits;
mod page;
mod problem;
mod schema;
mod source;
mod suggest;
mod tree;
mod write;

use std::path::Path;

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

pub use document::Document;
pub use error::Error;
pub use key_path::{KeyPath, Step};
pub use limits::MAX_FILE_BYTES;
pub use page::reference_page;
pub use problem::{Problem, Problems, Severity};
pub use suggest::nearest;

/// Reads a file; see [`Document::read`].
pub fn read<T: DeserializeOwned + JsonSchema>(path: impl AsRef<Path>) -> Result<T, Error> {
    Document::read(path).map(Document::into_value)
}

/// Reads a text; `path` is the file that messages name. See [`Document::parse`].
pub fn parse<T: DeserializeOwned + JsonSchema>(text: &str, path: impl AsRef<Path>) -> Result<T, Error> {
    Document::parse(text, path).map(Document::into_value)
}
