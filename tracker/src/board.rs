//! The board file: tags printed on one sheet.

use std::collections::HashMap;
use std::path::Path;

use coshade_config::{Document, Error, KeyPath};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::family::Family;

/// Tags on one flat sheet. Board frame: x right, y up along the print, z out of the paper, origin at its centre.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Board {
    /// Version of this format.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Family of all tags.
    pub family: Family,
    /// The tags.
    #[serde(rename = "tag")]
    #[schemars(length(min = 1, max = 4096))]
    pub tags: Vec<BoardTag>,
}

/// One tag of a board, upright as the board is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoardTag {
    /// Number within the family.
    pub id: u32,
    /// Side of the square through its four detected corners (tag36h11: outer edge of the black border).
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 100.0))]
    pub size_m: f64,
    /// Its centre, right and up from the board's.
    #[schemars(inner(range(min = -100.0, max = 100.0)))]
    pub position_m: [f64; 2],
}

impl Board {
    /// Reads a board file.
    ///
    /// # Errors
    /// [`Error::Invalid`] with all problems at once, each with its place; other variants if it cannot be read.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::read(path)?)
    }

    /// As [`Board::read`] from a text; `path` is the file that messages name.
    ///
    /// # Errors
    /// As [`Board::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::parse(text, path)?)
    }

    fn consistent(document: Document<Self>) -> Result<Self, Error> {
        let board = document.value();
        let mut problems = Vec::new();
        let mut first = HashMap::new();
        for (index, tag) in board.tags.iter().enumerate() {
            let at = KeyPath::root().key("tag").index(index);
            if tag.id >= board.family.tag_count() {
                let message = format!("{} has no tag {}", board.family, tag.id);
                let help = format!("allowed: from 0 to {}", board.family.tag_count() - 1);
                problems.push(document.error_at(at.key("id"), message, help));
            }
            if tag.size_m < 1e-6 {
                let message = format!("{} m is no length", tag.size_m);
                problems.push(document.error_at(
                    at.key("size_m"),
                    message,
                    "allowed: from 1e-6 to 100 metres",
                ));
            }
            if let Some(other) = first.insert(tag.id, index) {
                let message = format!("tag {} is tag[{other}] already", tag.id);
                problems.push(document.error_at(at.key("id"), message, "every tag is there once"));
            }
        }
        Document::<Self>::reject(problems)?;
        Ok(document.into_value())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOARD: &str = "version = 1\nfamily = 'tag36h11'\n[[tag]]\nid = 3\nsize_m = 0.03\nposition_m = [-0.02, 0.02]\n\
                         [[tag]]\nid = 4\nsize_m = 0.03\nposition_m = [0.02, 0.02]\n";

    #[test]
    fn a_board_is_read() {
        let board = Board::parse(BOARD, "board.toml").unwrap();
        assert_eq!(board.family, Family::Tag36h11);
        assert_eq!(board.tags[1], BoardTag { id: 4, size_m: 0.03, position_m: [0.02, 0.02] });
    }

    #[test]
    fn mistakes_are_named() {
        for (from, to, message) in [
            ("tag36h11", "tag36h10", "family"),
            ("id = 4", "id = 587", "tag[1].id: tag36h11 has no tag 587"),
            ("id = 4", "id = 3", "tag[1].id: tag 3 is tag[0] already"),
            ("0.03\n", "0.0\n", "tag[0].size_m"),
            ("size_m", "size", "unknown key"),
        ] {
            let error = Board::parse(&BOARD.replacen(from, to, 1), "board.toml").unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }

    #[test]
    fn damaged_boards_are_refused_or_read() {
        for (_, bytes) in coshade_testdata::mutate::mutations(BOARD.as_bytes(), 300) {
            let _ = Board::parse(&String::from_utf8_lossy(&bytes), "board.toml");
        }
    }
}
