//! What is wrong with a board.

use std::collections::HashMap;
use std::fmt;

use coshade_config::KeyPath;

use super::{Board, BoardTag, VERSION};

/// The smallest size of a tag, metres.
const MIN_SIZE_M: f64 = 1e-6;
/// The largest size of a tag, metres.
const MAX_SIZE_M: f64 = 100.0;

/// A value that is not allowed: where it is, what is wrong, what helps.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct BoardMistake {
    /// The key.
    pub key: KeyPath,
    /// What is wrong.
    pub message: String,
    /// What is allowed.
    pub help: String,
}

impl fmt::Display for BoardMistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.key, self.message)?;
        if self.help.is_empty() { Ok(()) } else { write!(f, " ({})", self.help) }
    }
}

impl BoardMistake {
    /// At a key of a tag.
    pub(super) fn new(key: &str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { key: KeyPath::root().key(key), message: message.into(), help: help.into() }
    }

    /// The same seen from the board.
    pub(super) fn of_tag(mut self, index: usize) -> Self {
        let mut key = KeyPath::root().key("tag").index(index);
        for step in self.key.steps() {
            key = match step {
                coshade_config::Step::Key(name) => key.key(name.clone()),
                coshade_config::Step::Index(index) => key.index(*index),
            };
        }
        self.key = key;
        self
    }
}

impl Board {
    /// Everything that is not allowed. A file's schema rules some of it out already; boards made in memory have none.
    pub fn mistakes(&self) -> Vec<BoardMistake> {
        let mut mistakes = Vec::new();
        if self.version != VERSION {
            let message = format!("version {} is not known", self.version);
            mistakes.push(BoardMistake::new("version", message, "allowed: 1"));
        }
        if self.tags.is_empty() {
            mistakes.push(BoardMistake::new("tag", "a board without tags", "add [[tag]]"));
        }
        let mut first = HashMap::new();
        for (index, tag) in self.tags.iter().enumerate() {
            let mut found = self.tag_mistakes(tag);
            if let Some(other) = first.insert(self.tag_id(tag), index) {
                let message = format!("{} is tag[{other}] already", self.tag_id(tag));
                found.push(BoardMistake::new("id", message, "every tag is there once"));
            }
            mistakes.extend(found.into_iter().map(|mistake| mistake.of_tag(index)));
        }
        mistakes
    }

    fn tag_mistakes(&self, tag: &BoardTag) -> Vec<BoardMistake> {
        let mut mistakes = Vec::new();
        let family = self.tag_id(tag).family;
        if tag.id >= family.tag_count() {
            let message = format!("{family} has no tag {}", tag.id);
            let help = format!("allowed: from 0 to {}", family.tag_count() - 1);
            mistakes.push(BoardMistake::new("id", message, help));
        }
        if !(MIN_SIZE_M..=MAX_SIZE_M).contains(&tag.size_m) {
            let message = format!("{} m is no length of a tag", tag.size_m);
            let help = format!("allowed: from {MIN_SIZE_M:e} to {MAX_SIZE_M} metres");
            mistakes.push(BoardMistake::new("size_m", message, help));
        }
        mistakes.extend(tag.board_from_tag().err());
        mistakes
    }
}
