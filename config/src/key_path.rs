//! The name of a place in a document: `thing[2].pose.position_m`.

use std::fmt;

/// One step down.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Step {
    /// Into a table.
    Key(String),
    /// Into an array, counted from 0.
    Index(usize),
}

/// A way down from the root of a document. The empty path is the document itself.
///
/// `&["camera", "size_px"]` converts into a path; a step that is a number in brackets or plain digits (`"[2]"`, `"2"`)
/// is an index where the document has an array.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct KeyPath(Vec<Step>);

impl KeyPath {
    /// The document itself.
    pub fn root() -> Self {
        Self::default()
    }

    /// This path and one key more.
    #[must_use]
    pub fn key(&self, key: impl Into<String>) -> Self {
        self.with(Step::Key(key.into()))
    }

    /// This path and one index more, counted from 0.
    #[must_use]
    pub fn index(&self, index: usize) -> Self {
        self.with(Step::Index(index))
    }

    /// The steps from the root down.
    pub fn steps(&self) -> &[Step] {
        &self.0
    }

    fn with(&self, step: Step) -> Self {
        let mut steps = self.0.clone();
        steps.push(step);
        Self(steps)
    }
}

impl<S: AsRef<str>> From<&[S]> for KeyPath {
    fn from(steps: &[S]) -> Self {
        Self(steps.iter().map(|step| parse_step(step.as_ref())).collect())
    }
}

impl<S: AsRef<str>, const N: usize> From<&[S; N]> for KeyPath {
    fn from(steps: &[S; N]) -> Self {
        Self::from(steps.as_slice())
    }
}

impl<S: AsRef<str>, const N: usize> From<[S; N]> for KeyPath {
    fn from(steps: [S; N]) -> Self {
        Self::from(steps.as_slice())
    }
}

impl From<&KeyPath> for KeyPath {
    fn from(path: &KeyPath) -> Self {
        path.clone()
    }
}

fn parse_step(step: &str) -> Step {
    let digits = step.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).unwrap_or(step);
    match digits.parse() {
        Ok(index) => Step::Index(index),
        Err(_) => Step::Key(step.to_owned()),
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, step) in self.0.iter().enumerate() {
            match step {
                Step::Index(index) => write!(f, "[{index}]")?,
                Step::Key(key) => {
                    let dot = if number == 0 { "" } else { "." };
                    write!(f, "{dot}{}", quoted_if_needed(key))?;
                }
            }
        }
        Ok(())
    }
}

/// Bare keys as they are, others in quotes with control characters escaped, as TOML would want them.
fn quoted_if_needed(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !key.is_empty() && key.len() <= 80 && key.chars().all(bare) {
        return key.to_owned();
    }
    let short: String = key.chars().take(80).collect();
    format!("{short:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_printed_as_a_user_would_write_it() {
        let path = KeyPath::root().key("thing").index(2).key("pose").key("a key");
        assert_eq!(path.to_string(), "thing[2].pose.\"a key\"");
        assert_eq!(KeyPath::root().to_string(), "");
        assert_eq!(KeyPath::root().key("a\u{1b}[2J\n").to_string(), "\"a\\u{1b}[2J\\n\"");
    }

    #[test]
    fn reads_indices_with_and_without_brackets() {
        let expected = KeyPath::root().key("thing").index(2).key("name");
        assert_eq!(KeyPath::from(&["thing", "2", "name"]), expected);
        assert_eq!(KeyPath::from(["thing", "[2]", "name"]), expected);
    }
}
