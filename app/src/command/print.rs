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

/// Writes an error and its causes to standard error, in one line. Nothing is done where that is closed.
pub fn error(error: &anyhow::Error) {
    let _ = writeln!(io::stderr().lock(), "error: {}", one_line(error));
}

/// An error and its causes. Many errors say their cause themselves, so a cause that has been said is left out.
fn one_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain().map(ToString::to_string).filter(|cause| !cause.is_empty()) {
        if !line.contains(&cause) {
            let colon = if line.is_empty() { "" } else { ": " };
            line = line + colon + &cause;
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    #[test]
    fn a_cause_is_said_once() {
        let said = anyhow!("no such file").context("a.mcap: cannot be read: no such file");
        assert_eq!(super::one_line(&said), "a.mcap: cannot be read: no such file");
        let unsaid = anyhow!("no such file").context("a.mcap");
        assert_eq!(super::one_line(&unsaid), "a.mcap: no such file");
    }
}
