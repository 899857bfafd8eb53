//! Optional real data for tests: photographs, recordings and meshes that are not part of the repository.
//!
//! The data lies in `$COSHADE_DATA`, else in `../shared/data` beside the checkout. A test whose data is absent is
//! skipped: it returns early, and a line is appended to the file `$COSHADE_SKIPPED` (if set) so that `scripts/test`
//! can list what was not tested.

pub mod mutate;

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The folder of the data, whether it exists or not.
pub fn root() -> PathBuf {
    match std::env::var_os("COSHADE_DATA") {
        Some(root) => root.into(),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
    }
}

/// The path of `relative` in the data, or `None` (and a line in the list of skipped tests) where it is absent.
///
/// `test` names the test in that list.
pub fn find(test: &str, relative: &str) -> Option<PathBuf> {
    let path = root().join(relative);
    if path.exists() {
        return Some(path);
    }
    skip(test, &format!("no data {relative}"));
    None
}

/// Notes that `test` was skipped and why. For tests that lack a program or a device instead of data.
pub fn skip(test: &str, why: &str) {
    let line = format!("skipped: {test}: {why}\n");
    let _ = std::io::stderr().write_all(line.as_bytes());
    if let Some(list) = std::env::var_os("COSHADE_SKIPPED") {
        // One write of one line: lines of tests that run at the same time do not mix.
        let file = OpenOptions::new().create(true).append(true).open(list);
        let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
    }
}
