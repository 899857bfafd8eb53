//! Reads text within limits, so that a hostile file costs neither memory nor stack.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use crate::error::Error;

/// Largest file that is read.
pub const MAX_FILE_BYTES: u64 = 16 << 20;
/// Deepest nesting of brackets in one value.
const MAX_BRACKETS: usize = 32;
/// Most parts of a dotted key.
const MAX_KEY_PARTS: usize = 16;
/// Most levels of a document, dotted keys and brackets together.
pub(crate) const MAX_DEPTH: usize = 64;
/// Most keys, array elements, headers and points (of dotted keys and of decimal numbers, which look alike here)
/// together: each costs the parsers up to some hundred bytes.
const MAX_VALUES: usize = 500_000;

/// A regular file's text.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    let failed = |source| Error::Read { path: path.to_path_buf(), source };
    // Asked before opening: opening a pipe that nobody writes to would wait forever.
    let metadata = std::fs::metadata(path).map_err(failed)?;
    if !metadata.is_file() {
        return Err(Error::NotAFile { path: path.to_path_buf() });
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(failed)?;
    file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(Error::TooLarge { path: path.to_path_buf() });
    }
    decode(bytes, path)
}

fn decode(bytes: Vec<u8>, path: &Path) -> Result<String, Error> {
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let before = error.as_bytes().get(..valid).unwrap_or_default();
        let before = String::from_utf8_lossy(before);
        let last_line = before.rsplit('\n').next().unwrap_or_default();
        Error::NotUtf8 {
            path: path.to_path_buf(),
            line: before.matches('\n').count() + 1,
            column: last_line.chars().count() + 1,
        }
    })
}

/// A limit that a text exceeds, and where.
pub(crate) struct Exceeded {
    pub span: Range<usize>,
    pub message: String,
}

/// Goes once over the text with a few counters, before any parser builds a tree of it. Strings and comments are
/// skipped; where the text is not TOML the counts mean little, and the parser will say so.
pub(crate) fn check_structure(text: &str) -> Result<(), Exceeded> {
    let bytes = text.as_bytes();
    let mut counts = Counts::default();
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let end = match byte {
            b'#' => line_end(bytes, at),
            b'"' | b'\'' => string_end(bytes, at),
            _ => {
                counts.count(byte).map_err(|message| Exceeded { span: at..at + 1, message })?;
                at + 1
            }
        };
        at = end;
    }
    Ok(())
}

#[derive(Default)]
struct Counts {
    brackets: usize,
    key_parts: usize,
    values: usize,
}

impl Counts {
    fn count(&mut self, byte: u8) -> Result<(), String> {
        match byte {
            b'[' | b'{' => {
                self.brackets += 1;
                self.values += 1;
                self.key_parts = 0;
            }
            b']' | b'}' => self.brackets = self.brackets.saturating_sub(1),
            b',' | b'=' | b'\n' => {
                self.values += usize::from(byte != b'\n');
                self.key_parts = 0;
            }
            b'.' => {
                self.key_parts += 1;
                self.values += 1;
            }
            _ => {}
        }
        if self.brackets > MAX_BRACKETS {
            return Err(format!("brackets nested deeper than {MAX_BRACKETS}"));
        }
        if self.key_parts >= MAX_KEY_PARTS {
            return Err(format!("key of more than {MAX_KEY_PARTS} parts"));
        }
        if self.values > MAX_VALUES {
            return Err(format!("more than {MAX_VALUES} values (a decimal point counts as one)"));
        }
        Ok(())
    }
}

fn line_end(bytes: &[u8], at: usize) -> usize {
    let rest = bytes.get(at..).unwrap_or_default();
    at + rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len())
}

/// Behind the string that starts at `at`: basic or literal, on one line or on several. A string that does not end is
/// taken to end with its line (or the text), so that what follows is still counted.
fn string_end(bytes: &[u8], at: usize) -> usize {
    let rest = bytes.get(at..).unwrap_or_default();
    let Some(&quote) = rest.first() else {
        return at + 1;
    };
    let multi_line = rest.starts_with(&[quote; 3]);
    let closing = if multi_line { 3 } else { 1 };
    let mut i = closing;
    while let Some(&byte) = rest.get(i) {
        match byte {
            b'\\' if quote == b'"' => i += 2,
            b'\n' if !multi_line => return at + i,
            _ if byte == quote
                && rest.get(i..i + closing).is_some_and(|end| end.iter().all(|&b| b == quote)) =>
            {
                return at + i + closing;
            }
            _ => i += 1,
        }
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_and_comments_do_not_count() {
        let brackets = "[".repeat(1000);
        for text in [
            format!("# {brackets}\na = 1"),
            format!("a = \"{brackets}\""),
            format!("a = '{brackets}'"),
            format!("a = \"\\\"{brackets}\""),
            format!("a = \"\"\"\n\"{brackets}\n\"\"\""),
            format!("a = '''\n'{brackets}\n'''"),
        ] {
            assert!(check_structure(&text).is_ok(), "{text}");
        }
    }

    #[test]
    fn limits_are_found_at_their_place() {
        let text = format!("a = {}", "[".repeat(MAX_BRACKETS + 1));
        assert_eq!(check_structure(&text).unwrap_err().span.start, 4 + MAX_BRACKETS);
        let text = format!("a{} = 1", ".a".repeat(MAX_KEY_PARTS));
        assert!(check_structure(&text).is_err());
        let text = format!("a = [{}]", "0,".repeat(MAX_VALUES));
        assert!(check_structure(&text).is_err());
        let text = "a = 1.5\n".repeat(1000);
        assert!(check_structure(&text).is_ok());
    }
}
