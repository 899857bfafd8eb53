//! `coshade info`: what is in a file or folder, and what is wrong with it.

mod calibration;
mod folder;
mod kind;
mod mesh;
mod picture;
mod recording;
mod rig;
mod session;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde::Serialize;

use super::print;
use kind::Kind;

/// Say what is in a file or folder, and what is wrong with it.
///
/// Knows recordings (MCAP, ROS 1 bags), calibration, rig and session files, meshes (glTF, OBJ, PLY), images (EXR, HDR,
/// PNG, JPEG) and folders of images (also TUM RGB-D, 7-Scenes). Exit code 1 if something is wrong with the file.
#[derive(clap::Args)]
pub struct Args {
    /// The file or folder
    path: PathBuf,
    /// Metres a count of the depth images in a folder, where nothing else says
    #[arg(long, value_name = "METRES")]
    depth_unit_m: Option<f64>,
    /// Print one JSON object: `path`, `kind`, `problems` (each with `severity` and `message`), and under `content`
    /// what is in the file; units are in the names
    #[arg(long)]
    json: bool,
}

/// What was found.
#[derive(Serialize)]
struct Info {
    path: PathBuf,
    kind: Kind,
    content: serde_json::Value,
    problems: Vec<Problem>,
    #[serde(skip)]
    text: String,
}

#[derive(Serialize)]
struct Problem {
    severity: Severity,
    message: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Severity {
    Note,
    Warning,
    Error,
}

/// What one kind of file says of itself.
struct Found {
    content: serde_json::Value,
    text: String,
    problems: Vec<Problem>,
}

impl Problem {
    fn new(severity: Severity, message: impl Into<String>) -> Self {
        Self { severity, message: message.into() }
    }
}

/// Looks and prints.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let info = look(&args.path, args.depth_unit_m)?;
    if args.json {
        print::json(&info)?;
    } else {
        print::text(&readable(&info))?;
    }
    let wrong = info.problems.iter().any(|problem| problem.severity == Severity::Error);
    Ok(if wrong { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn look(path: &Path, depth_unit_m: Option<f64>) -> anyhow::Result<Info> {
    let kind = kind::of(path)?;
    let found = match kind {
        Kind::Folder => folder::look(path, depth_unit_m),
        Kind::Recording => recording::look(path),
        Kind::Mesh => mesh::look(path),
        Kind::Image => picture::look(path),
        Kind::DepthImage => folder::look_at_file(path, depth_unit_m),
        Kind::Calibration => calibration::look(path),
        Kind::Session => session::look(path),
        Kind::Rig => rig::look(path),
    }?;
    Ok(Info {
        path: path.to_owned(),
        kind,
        content: found.content,
        problems: found.problems,
        text: found.text,
    })
}

fn readable(info: &Info) -> String {
    let mut out = format!("{}: {}\n{}", info.path.display(), info.kind.name(), info.text);
    for problem in &info.problems {
        let label = match problem.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        let _ = writeln!(out, "{label}: {}", problem.message);
    }
    out
}
