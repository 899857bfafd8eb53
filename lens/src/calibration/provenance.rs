//! How a calibration came about.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::calibration::Mistake;

/// Where the numbers come from, for people and for the quality report. Nothing here changes how images are processed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// When it was made, such as "2026-03-01T14:05:00Z" (RFC 3339, in quotes).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<String>,
    /// What made it: program and version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// The images it was made from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub images: Vec<String>,
    /// Root mean square of the reprojection errors, in pixels: distances, not their x and y apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub rms_px: Option<f64>,
    /// Anything else worth knowing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notes: Option<String>,
    /// Covariance of the lens' parameters, as rows of numbers, in the order in which the lens model lists them (fx, fy,
    /// cx, cy, then the distortion).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Standard deviations of the lens' parameters, by name: `fx = 0.3`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub std_dev: BTreeMap<String, f64>,
}

impl Provenance {
    /// The first mistake, its key counted from the provenance, or `None`; `names` are the lens' parameters.
    pub fn mistake(&self, names: &[&str]) -> Option<Mistake> {
        if let Some(rms_px) = self.rms_px.filter(|rms| !(*rms >= 0.0 && rms.is_finite())) {
            return Some(Mistake::new(&["rms_px"], format!("`{rms_px}` is out of range"), "0 or more"));
        }
        for (name, value) in &self.std_dev {
            if !names.contains(&name.as_str()) {
                let message = format!("the lens has no parameter of this name; it has {}", names.join(", "));
                return Some(Mistake::new(&["std_dev", name], message, "the lens' parameters"));
            }
            if !(*value >= 0.0 && value.is_finite()) {
                return Some(Mistake::new(
                    &["std_dev", name],
                    format!("`{value}` is out of range"),
                    "0 or more",
                ));
            }
        }
        covariance_mistake(self.covariance.as_ref()?, names.len())
    }

    /// The same for the image scaled by `scale` per axis: uncertainties in pixels scale with the image.
    pub(crate) fn scaled(&self, names: &[&str], scale: nalgebra::Vector2<f64>) -> Self {
        let factor = |name: &str| match name {
            "fx" | "cx" => scale.x,
            "fy" | "cy" => scale.y,
            _ => 1.0,
        };
        let mut scaled = self.clone();
        scaled.rms_px = self.rms_px.map(|rms| rms * (scale.x * scale.y).sqrt());
        for (name, value) in &mut scaled.std_dev {
            *value *= factor(name);
        }
        for (row, row_name) in scaled.covariance.iter_mut().flatten().zip(names) {
            for (value, name) in row.iter_mut().zip(names) {
                *value *= factor(row_name) * factor(name);
            }
        }
        scaled
    }
}

fn covariance_mistake(rows: &[Vec<f64>], size: usize) -> Option<Mistake> {
    let wrong = |key: &[&str], message| {
        let key: Vec<&str> = std::iter::once("covariance").chain(key.iter().copied()).collect();
        Some(Mistake::new(
            &key,
            message,
            "a symmetric matrix with a row and a column for each parameter of the lens, no diagonal below 0",
        ))
    };
    if rows.len() != size {
        return wrong(&[], format!("{} rows, but the lens has {size} parameters", rows.len()));
    }
    for (y, row) in rows.iter().enumerate() {
        if row.len() != size {
            return wrong(
                &[&y.to_string()],
                format!("{} numbers, but the lens has {size} parameters", row.len()),
            );
        }
    }
    let at = |y: usize, x: usize| rows.get(y).and_then(|row| row.get(x)).copied().unwrap_or(f64::NAN);
    for y in 0..size {
        for x in 0..=y {
            let (value, mirrored) = (at(y, x), at(x, y));
            let size = (at(x, x) * at(y, y)).abs().sqrt();
            let symmetric = value.is_finite() && (value - mirrored).abs() <= 1e-6 * size.max(value.abs());
            if !symmetric || (x == y && value < 0.0) {
                let message = format!("{value} does not fit (mirrored: {mirrored})");
                return wrong(&[&y.to_string(), &x.to_string()], message);
            }
        }
    }
    None
}
