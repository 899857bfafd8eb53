//! The text of a file, and where in it something stands.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Longest excerpt of a source line that is shown, in characters.
const EXCERPT_CHARS: usize = 110;

/// Some editors begin a file with it; it is no column.
pub(crate) const BYTE_ORDER_MARK: char = '\u{feff}';

/// A text and the file it came from. Cheap to clone.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    path: Arc<Path>,
    text: Arc<str>,
    /// Byte offsets where lines start.
    line_starts: Arc<[usize]>,
}

/// A line of the source with the part that is meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Excerpt {
    /// The line, without characters that would disturb a terminal.
    pub line: String,
    /// Characters of `line` before the caret.
    pub caret: usize,
    /// Carets to draw, at least 1.
    pub carets: usize,
}

impl Source {
    pub(crate) fn new(path: &Path, text: &str) -> Self {
        let starts = text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n').map(|(at, _)| at + 1);
        Self { path: path.into(), text: text.into(), line_starts: std::iter::once(0).chain(starts).collect() }
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.path.to_path_buf()
    }

    /// The text of a span; empty if the span is not within the text.
    pub(crate) fn slice(&self, span: &Range<usize>) -> &str {
        self.text.get(span.clone()).unwrap_or_default()
    }

    /// Line and column of a byte offset, both from 1; columns count characters.
    pub(crate) fn line_and_column(&self, offset: usize) -> (usize, usize) {
        let line = self.line_index(offset);
        let before = self.slice(&(self.line_start(line)..offset.min(self.text.len())));
        (line + 1, before.trim_start_matches(BYTE_ORDER_MARK).chars().count() + 1)
    }

    /// The line where a span starts, with carets under the part of the span that lies on it.
    pub(crate) fn excerpt(&self, span: &Range<usize>) -> Excerpt {
        let index = self.line_index(span.start);
        let start = self.line_start(index);
        let end = self.line_starts.get(index + 1).copied().unwrap_or(self.text.len());
        let line =
            self.slice(&(start..end)).trim_start_matches(BYTE_ORDER_MARK).trim_end_matches(['\n', '\r']);
        let column = self.line_and_column(span.start).1 - 1;
        let on_line = self.slice(&(span.start..span.end.min(start + line.len()).max(span.start)));
        let first = column.saturating_sub(EXCERPT_CHARS / 2);
        let shown: String = line.chars().skip(first).take(EXCERPT_CHARS).map(printable).collect();
        let caret = column - first;
        let room = shown.chars().count().saturating_sub(caret);
        Excerpt { line: shown, caret, carets: on_line.chars().count().min(room).max(1) }
    }

    fn line_index(&self, offset: usize) -> usize {
        self.line_starts.partition_point(|&start| start <= offset).saturating_sub(1)
    }

    fn line_start(&self, index: usize) -> usize {
        self.line_starts.get(index).copied().unwrap_or(0)
    }
}

/// Control characters and marks that turn the reading direction do not reach a terminal.
pub(crate) fn printable(c: char) -> char {
    match c {
        '\t' => ' ',
        c if c.is_control() => '\u{fffd}',
        '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}' => {
            '\u{fffd}'
        }
        c => c,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_from_one_and_columns_count_characters() {
        let source = Source::new(Path::new("a.toml"), "a = 1\nä = 2\r\n");
        assert_eq!(source.line_and_column(0), (1, 1));
        assert_eq!(source.line_and_column(6), (2, 1));
        assert_eq!(source.line_and_column(8), (2, 2));
        assert_eq!(source.line_and_column(14), (3, 1));
        assert_eq!(source.line_and_column(9999), (3, 1));
    }

    #[test]
    fn excerpts_of_long_lines_are_cut_around_the_caret() {
        let text = format!("x = \"{}\"", "y".repeat(1000));
        let excerpt = Source::new(Path::new("a.toml"), &text).excerpt(&(500..503));
        assert_eq!(excerpt.line.chars().count(), EXCERPT_CHARS);
        assert_eq!((excerpt.caret, excerpt.carets), (EXCERPT_CHARS / 2, 3));
    }

    #[test]
    fn escape_sequences_do_not_reach_the_terminal() {
        let excerpt = Source::new(Path::new("a.toml"), "a = \u{1b}[2J\t1\r\n").excerpt(&(4..5));
        assert_eq!(excerpt.line, "a = \u{fffd}[2J 1");
    }
}
