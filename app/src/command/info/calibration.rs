//! Calibration files of cameras.

use std::fmt::Write as _;
use std::path::Path;

use coshade_lens::calibration::Calibration;

use super::{Found, Problem, Severity};

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let calibration = Calibration::read(path)?;
    Ok(Found {
        content: serde_json::to_value(&calibration)?,
        text: text(&calibration),
        problems: problems(&calibration),
    })
}

fn text(calibration: &Calibration) -> String {
    let Calibration { size_px: [width, height], model, .. } = calibration;
    let mut out = format!("  {width}x{height} px, {}:", model.kind().name());
    for (name, value) in model.kind().param_names().iter().zip(model.params()) {
        let _ = write!(out, " {name} {value}");
    }
    let _ = writeln!(out, "\n  valid up to {:.2}° off the axis", model.max_angle_rad().to_degrees());
    if let Some([x, y]) = field_of_view_deg(calibration) {
        let _ = writeln!(out, "  field of view {x:.1}° x {y:.1}° through the image's middle");
    }
    let provenance = &calibration.provenance;
    if let Some(rms_px) = provenance.rms_px {
        let _ = writeln!(out, "  reprojection error {rms_px} px RMS over {} images", provenance.images.len());
    }
    for (label, value) in [("made", &provenance.when), ("by", &provenance.tool), ("notes", &provenance.notes)]
    {
        if let Some(value) = value {
            let _ = writeln!(out, "  {label}: {value}");
        }
    }
    out
}

/// Angles between the rays of the first and last pixel of the middle row and column; `None` where a lens does not
/// reach the image's edge.
fn field_of_view_deg(calibration: &Calibration) -> Option<[f64; 2]> {
    let [width, height] = calibration.size_px.map(f64::from);
    let (middle_x, middle_y) = ((width - 1.0) / 2.0, (height - 1.0) / 2.0);
    let angle = |[ax, ay]: [f64; 2], [bx, by]: [f64; 2]| {
        let a = calibration.model.unproject(&[ax, ay].into())?;
        let b = calibration.model.unproject(&[bx, by].into())?;
        let axis_a = a.z.clamp(-1.0, 1.0).acos();
        let axis_b = b.z.clamp(-1.0, 1.0).acos();
        // Through the axis, so that fields of view beyond 180° come out right.
        Some((axis_a + axis_b).to_degrees())
    };
    Some([
        angle([-0.5, middle_y], [width - 0.5, middle_y])?,
        angle([middle_x, -0.5], [middle_x, height - 0.5])?,
    ])
}

fn problems(calibration: &Calibration) -> Vec<Problem> {
    let mut problems = Vec::new();
    let [width, height] = calibration.size_px.map(f64::from);
    let params = calibration.model.params();
    if let [fx, fy, cx, cy, ..] = params[..] {
        if (fx / fy - 1.0).abs() > 0.02 {
            let message =
                format!("fx and fy differ by {:.1}%: rare on real sensors", (fx / fy - 1.0).abs() * 100.0);
            problems.push(Problem::new(Severity::Warning, message));
        }
        let off = ((cx - (width - 1.0) / 2.0) / width).hypot((cy - (height - 1.0) / 2.0) / height);
        if off > 0.15 {
            let message = format!("the principal point ({cx}, {cy}) is far from the image's middle");
            problems.push(Problem::new(Severity::Warning, message));
        }
    }
    if calibration.provenance.tool.is_none() && calibration.provenance.when.is_none() {
        problems.push(Problem::new(Severity::Note, "does not say how it came about (no [provenance])"));
    }
    problems
}
