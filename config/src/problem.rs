//! What is wrong with a file, and where.

use std::fmt;
use std::path::PathBuf;

use crate::key_path::KeyPath;
use crate::source::{Excerpt, Source};

/// Most problems that are reported of one file.
pub(crate) const MAX_PROBLEMS: usize = 100;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The file works, but probably not as meant.
    Warning,
    /// The file cannot be used.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// One thing that is wrong with a file. Printed as `file:line:column: error: key: message`, the source line with a
/// caret, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// How bad it is.
    pub severity: Severity,
    /// The file.
    pub path: PathBuf,
    /// From 1.
    pub line: usize,
    /// In characters, from 1.
    pub column: usize,
    /// Full path of the key that is meant, such as `thing[2].pose.position_m`; empty for the file as a whole.
    pub key: String,
    /// What is wrong.
    pub message: String,
    /// What to do about it, or what is allowed.
    pub help: Option<String>,
    pub(crate) excerpt: Excerpt,
}

impl Problem {
    pub(crate) fn new(source: &Source, span: std::ops::Range<usize>, key: &KeyPath, message: String) -> Self {
        let (line, column) = source.line_and_column(span.start);
        Self {
            severity: Severity::Error,
            path: source.path(),
            line,
            column,
            key: key.to_string(),
            message,
            help: None,
            excerpt: source.excerpt(&span),
        }
    }

    pub(crate) fn with_help(mut self, help: impl Into<String>) -> Self {
        let help = help.into();
        self.help = (!help.is_empty()).then_some(help);
        self
    }

    /// True unless it is only a warning.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }

    /// The same as a warning.
    #[must_use]
    pub fn warning(mut self) -> Self {
        self.severity = Severity::Warning;
        self
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (path, line, column) = (self.path.display(), self.line, self.column);
        write!(f, "{path}:{line}:{column}: {}: ", self.severity)?;
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        writeln!(f, "{}", self.message)?;
        let number = line.to_string();
        let gutter = " ".repeat(number.len());
        let before = " ".repeat(self.excerpt.caret);
        let carets = "^".repeat(self.excerpt.carets);
        writeln!(f, "{gutter} |")?;
        writeln!(f, "{number} | {}", self.excerpt.line)?;
        write!(f, "{gutter} | {before}{carets}")?;
        if let Some(help) = &self.help {
            write!(f, "\n{gutter} = {help}")?;
        }
        Ok(())
    }
}

/// All problems of one file, in the order of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problems {
    list: Vec<Problem>,
    /// Found beyond the first [`MAX_PROBLEMS`].
    unlisted: usize,
}

impl Problems {
    /// Sorts them by place and keeps the first hundred.
    pub(crate) fn sorted(mut list: Vec<Problem>) -> Self {
        list.sort_by_key(|problem| (problem.line, problem.column));
        // A key that two variants share is checked against both.
        list.dedup();
        let unlisted = list.len().saturating_sub(MAX_PROBLEMS);
        list.truncate(MAX_PROBLEMS);
        Self { list, unlisted }
    }

    /// In the order of the file; never empty.
    pub fn list(&self) -> &[Problem] {
        &self.list
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, problem) in self.list.iter().enumerate() {
            let separator = if number == 0 { "" } else { "\n\n" };
            write!(f, "{separator}{problem}")?;
        }
        match self.unlisted {
            0 => Ok(()),
            unlisted => write!(f, "\n\n… and {unlisted} more problems"),
        }
    }
}
