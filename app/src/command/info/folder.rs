//! Folders of images, and single PGM and PPM files.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::bail;
use coshade_capture::images::{self, DepthSummary, DescribeError, Description, FolderLayout, UnitSource};

use super::{Found, Problem, Severity, kind};

pub fn look(path: &Path, depth_unit_m: Option<f64>) -> anyhow::Result<Found> {
    let description = match images::describe(path, depth_unit_m) {
        Err(DescribeError::NoImages { .. }) => bail!("{}: {}", path.display(), without_images(path)),
        described => described?,
    };
    let mut text = String::new();
    if description.layout != FolderLayout::Images {
        let _ = writeln!(text, "  {}", description.layout.name());
    }
    text += &series_lines(&description);
    if description.poses > 0 {
        let _ = writeln!(text, "  {} camera poses", description.poses);
    }
    Ok(Found { content: serde_json::to_value(&description)?, text, problems: problems(&description) })
}

/// A single image that is no picture for people: PGM, PPM, 16 bit grey.
pub fn look_at_file(path: &Path, depth_unit_m: Option<f64>) -> anyhow::Result<Found> {
    let description = images::describe_file(path, depth_unit_m);
    if description.series.is_empty() {
        bail!("{}", description.problems.join("; "));
    }
    let problems = problems(&description);
    Ok(Found { content: serde_json::to_value(&description)?, text: series_lines(&description), problems })
}

fn series_lines(description: &Description) -> String {
    let mut out = String::new();
    for series in &description.series {
        let _ = writeln!(out, "  {}\n    {}", series.line(), series.uri);
    }
    out
}

/// What is wrong with the images. Where none can be read that is an error.
pub fn problems(description: &Description) -> Vec<Problem> {
    let severity = if description.series.is_empty() { Severity::Error } else { Severity::Warning };
    let mut problems: Vec<_> =
        description.problems.iter().map(|problem| Problem::new(severity, problem.clone())).collect();
    let assumed = |depth: &DepthSummary| depth.unit_source == UnitSource::Assumed;
    if description.series.iter().filter_map(|series| series.depth.as_ref()).any(assumed) {
        let message = "nothing states the depth unit: 1 mm assumed; give the right one with --depth-unit-m";
        problems.push(Problem::new(Severity::Note, message));
    }
    if description.series.iter().any(|series| series.depth.is_none() && series.codes.is_some()) {
        let message =
            "16 bit grey is taken for brightness; if it is depth, give its unit with --depth-unit-m";
        problems.push(Problem::new(Severity::Note, message));
    }
    problems
}

/// What to look at instead in a folder without images.
fn without_images(folder: &Path) -> String {
    const NAMED: usize = 5;
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut known: Vec<_> = entries.filter(|path| path.is_dir() || kind::by_ending(path).is_some()).collect();
    known.sort();
    let name =
        |path: &std::path::PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut names: Vec<_> = known.iter().take(NAMED).map(name).collect();
    if known.len() > NAMED {
        names.push(format!("and {} more", known.len() - NAMED));
    }
    let none = "no images (PNG, JPEG, PGM, PPM, EXR, HDR) here or one folder below";
    if names.is_empty() { none.to_owned() } else { format!("{none}; look at one of {}", names.join(", ")) }
}
