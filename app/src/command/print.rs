//! Where results go: standard output, which may be a closed pipe.

use std::io::{self, Write};

use serde::Serialize;

/// Writes `text` to standard output. A reader that has gone away (`| head`) is no error.
pub fn text(text: &str) -> anyhow::Result<()> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

/// Writes `value` as one JSON object, indented, with a line end.
pub fn json(value: &impl Serialize) -> anyhow::Result<()> {
    text(&(serde_json::to_string_pretty(value)? + "\n"))
}
