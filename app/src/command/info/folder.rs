//! Folders of images, and single PGM and PPM files.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Context as _;
use coshade_capture::images::{self, DepthSummary, Description, UnitSource};

use super::{Found, Problem, Severity};

pub fn look(path: &Path, depth_unit_m: Option<f64>) -> anyhow::Result<Found> {
    let description = images::describe(path, depth_unit_m)?;
    let mut problems: Vec<_> =
        description.problems.iter().map(|problem| Problem::new(Severity::Warning, problem.clone())).collect();
    let assumed = |depth: &DepthSummary| depth.unit_source == UnitSource::Assumed;
    if description.series.iter().filter_map(|series| series.depth.as_ref()).any(assumed) {
        let message = "nothing states the depth unit: 1 mm assumed; give the right one with --depth-unit-m";
        problems.push(Problem::new(Severity::Note, message));
    }
    Ok(Found { content: serde_json::to_value(&description)?, text: text(&description), problems })
}

fn text(description: &Description) -> String {
    let mut out = String::new();
    for series in &description.series {
        let _ = writeln!(out, "  {}", series.line());
        let _ = writeln!(out, "    {}", series.uri);
    }
    if description.poses > 0 {
        let _ = writeln!(out, "  {} camera poses", description.poses);
    }
    out
}

/// One image as a source of its own.
pub fn look_at_file(path: &Path, depth_unit_m: Option<f64>) -> anyhow::Result<Found> {
    let mut uri = format!("images:{}", path.display());
    if let Some(unit_m) = depth_unit_m {
        let _ = write!(uri, "?depth_unit_m={unit_m}");
    }
    let mut camera = coshade_capture::open(&uri)?;
    let frame = camera.next_frame(std::time::Duration::from_secs(10)).with_context(|| uri.clone())?;
    let (width, height, format) = (frame.width_px, frame.height_px, frame.format);
    Ok(Found {
        content: serde_json::json!({ "uri": uri, "width_px": width, "height_px": height, "format": format }),
        text: format!("  {width}x{height} px {format:?}\n"),
        problems: Vec::new(),
    })
}
