//! `coshade info`: what is in a file or folder, and what is wrong with it.

mod board;
mod calibration;
mod folder;
pub mod kind;
mod mesh;
mod picture;
mod recording;
mod rig;
mod session;
mod world;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde::Serialize;

use super::print;
use kind::Kind;

/// Say what is in a file or folder, and what is wrong with it.
///
/// Knows recordings (MCAP, ROS 1 bags), calibration, rig, board, world and session files, meshes (glTF, OBJ, PLY), images (EXR, HDR,
/// PNG, JPEG, PGM) and folders of images (also TUM RGB-D, 7-Scenes). Exit code 1 if something is wrong with the file, 2
/// if it cannot be read.
#[derive(clap::Args)]
pub struct Args {
    /// The file or folder
    path: PathBuf,
    /// Take 16 bit grey images for depth, with so many metres a count: 0.001 for millimetres, 0.0002 for TUM
    #[arg(long, value_name = "METRES", value_parser = depth_unit, allow_negative_numbers = true)]
    depth_unit_m: Option<f64>,
    /// Print one JSON object: `path`, `kind`, `problems` (each with `severity` and `message`), and under `content`
    /// what is in the file; units are in the names
    #[arg(long)]
    json: bool,
}

/// What was found.
#[derive(Serialize)]
struct Info {
    path: String,
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

fn depth_unit(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(unit_m) if unit_m > 0.0 && unit_m <= 1.0 => Ok(unit_m),
        _ => Err("metres a count, above 0 and at most 1, such as 0.001".to_owned()),
    }
}

fn look(path: &Path, depth_unit_m: Option<f64>) -> anyhow::Result<Info> {
    let kind = kind::of(path)?;
    let found = match kind {
        Kind::Folder => folder::look(path, depth_unit_m),
        Kind::Recording => recording::look(path),
        Kind::Mesh => mesh::look(path),
        Kind::Image => picture::look(path, depth_unit_m),
        Kind::DepthImage => folder::look_at_file(path, depth_unit_m),
        Kind::Calibration => calibration::look(path),
        Kind::Session => session::look(path),
        Kind::Rig => rig::look(path),
        Kind::Board => board::look(path),
        Kind::World => world::look(path),
    }?;
    Ok(Info {
        path: path.display().to_string(),
        kind,
        content: found.content,
        problems: found.problems,
        text: found.text,
    })
}

fn readable(info: &Info) -> String {
    let mut out = format!("{}: {}\n{}", info.path, info.kind.name(), info.text);
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
