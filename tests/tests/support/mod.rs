//! Runs the `coshade` binary, and makes files for it.

#![expect(clippy::unwrap_used, clippy::panic, reason = "helpers of tests: a panic is a failed test")]
#![allow(dead_code, reason = "not every test uses every helper")]

use std::path::{Path, PathBuf};
use std::process::Command;

use image::{Rgb, RgbImage};

/// What a run printed and how it ended.
pub struct Run {
    pub args: String,
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

/// Runs `coshade ARGS` (separated by blanks) in `folder`.
pub fn coshade(folder: &Path, args: &str) -> Run {
    let output = Command::new(binary()).args(args.split_whitespace()).current_dir(folder).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    Run {
        args: args.to_owned(),
        code: output.status.code(),
        stdout: text(output.stdout),
        stderr: text(output.stderr),
    }
}

impl Run {
    /// It must have ended with 0.
    pub fn success(self) -> Self {
        self.failure(0)
    }

    /// It must have ended with `code`.
    pub fn failure(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "coshade {}\n{}{}", self.args, self.stdout, self.stderr);
        self
    }

    /// It must have ended by itself, with 0 or 1.
    pub fn any(self) -> Self {
        assert!(matches!(self.code, Some(0 | 1)), "coshade {}\n{}{}", self.args, self.stdout, self.stderr);
        self
    }

    /// Its standard output must be one JSON object.
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("coshade {}: {error}\n{}", self.args, self.stdout))
    }
}

/// The program that `cargo test --workspace` has built beside this test.
pub fn binary() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let folder = test.parent().and_then(Path::parent).unwrap();
    let binary = folder.join("coshade");
    assert!(binary.exists(), "{} is not built: cargo build --workspace", binary.display());
    binary
}

/// A file of the workspace.
pub fn workspace(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(relative)
}

/// Numbered PNG files, no two alike.
pub fn gradient_frames(folder: &Path, count: u32, [width, height]: [u32; 2]) {
    std::fs::create_dir_all(folder).unwrap();
    for index in 0..count {
        let pixel = |x: u32, y: u32| {
            Rgb([(x * 3 + index) as u8, (y * 5) as u8, (x ^ y).wrapping_add(7 * index) as u8])
        };
        RgbImage::from_fn(width, height, pixel).save(folder.join(format!("{index:04}.png"))).unwrap();
    }
}
