//! Vignetting: how much less light arrives away from the middle of the image.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::calibration::Mistake;
use crate::pixel::CameraPx;

/// What arrives never counts as less than this, so the gain is at most 50.
pub const MIN_FALLOFF: f64 = 0.02;

/// How the light falls off towards the border, as a factor: 1 where it is brightest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Vignetting {
    /// No falloff, or already corrected by the camera.
    #[default]
    None,
    /// Falloff = 1 + k1·ρ² + k2·ρ⁴ + …, where ρ is the distance from `center_px` divided by `radius_px`.
    Radial {
        /// Centre in pixels, x right and y down; the centre of the first pixel is at [0, 0].
        center_px: [f64; 2],
        /// The distance that counts as 1, in pixels: usually half the image's diagonal, or the radius of a fish-eye's
        /// image circle.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius_px: f64,
        /// The factors of ρ², ρ⁴, ρ⁶, …, at most 8.
        #[schemars(length(min = 1, max = 8))]
        coefficients: Vec<f64>,
    },
    /// Falloff by the angle from the optical axis, straight between the points, constant beyond the last.
    Angle {
        /// Angles in degrees, rising from 0 to at most 180, 2 to 1024 numbers.
        angles_deg: Vec<f64>,
        /// The falloff at each angle, from 0.02 to 2.
        falloff: Vec<f64>,
    },
}

impl Vignetting {
    /// The fraction of the light that arrives at a place of the image that is seen `angle_rad` off the optical axis;
    /// at least [`MIN_FALLOFF`].
    pub fn falloff(&self, position: CameraPx, angle_rad: f64) -> f64 {
        let falloff = match self {
            Self::None => 1.0,
            Self::Radial { center_px, radius_px, coefficients } => {
                let distance = (position.0 - nalgebra::Vector2::from(*center_px)).norm() / radius_px;
                radial(coefficients, distance)
            }
            Self::Angle { angles_deg, falloff } => interpolate(angles_deg, falloff, angle_rad.to_degrees()),
        };
        // `max` also turns a NaN from an absurd position into the bound.
        falloff.max(MIN_FALLOFF)
    }

    /// What a linear value has to be multiplied by to undo the vignetting: 1 / falloff, at most 50.
    pub fn gain(&self, position: CameraPx, angle_rad: f64) -> f64 {
        1.0 / self.falloff(position, angle_rad)
    }

    /// The same falloff for the image scaled by `scale` per axis. The radius is scaled by the mean of the two.
    pub fn scaled(&self, scale: nalgebra::Vector2<f64>) -> Self {
        match self {
            Self::Radial { center_px, radius_px, coefficients } => Self::Radial {
                center_px: CameraPx(nalgebra::Vector2::from(*center_px)).scaled(scale).0.into(),
                radius_px: radius_px * (scale.x * scale.y).sqrt(),
                coefficients: coefficients.clone(),
            },
            other => other.clone(),
        }
    }

    /// The first mistake, its key counted from the vignetting, or `None`. A radial falloff is
    /// judged up to `farthest_px`, the largest distance from its centre that is used, given that centre.
    pub fn mistake(&self, farthest_px: impl Fn([f64; 2]) -> f64) -> Option<Mistake> {
        let wrong = |key: &[&str], message, allowed| Some(Mistake::new(key, message, allowed));
        match self {
            Self::None => None,
            Self::Radial { center_px, radius_px, coefficients } => {
                if !center_px.iter().all(|c| c.abs() < 1e6) {
                    return wrong(
                        &["center_px"],
                        format!("`{center_px:?}` is out of range"),
                        "numbers between −1e6 and 1e6",
                    );
                }
                if !(*radius_px > 0.0 && *radius_px < 1e6) {
                    return wrong(
                        &["radius_px"],
                        format!("`{radius_px}` is out of range"),
                        "more than 0 and less than 1e6",
                    );
                }
                if !(1..=8).contains(&coefficients.len()) || !coefficients.iter().all(|k| k.is_finite()) {
                    return wrong(
                        &["coefficients"],
                        format!("`{coefficients:?}` does not fit"),
                        "1 to 8 finite numbers",
                    );
                }
                let farthest = farthest_px(*center_px) / radius_px;
                let bad = (0..=256).map(|i| f64::from(i) / 256.0 * farthest).find_map(|distance| {
                    let falloff = radial(coefficients, distance);
                    (!(MIN_FALLOFF..=2.0).contains(&falloff)).then_some((distance, falloff))
                });
                let (distance, falloff) = bad?;
                wrong(
                    &["coefficients"],
                    format!(
                        "the falloff at {:.0} px from the centre would be {falloff:.3}",
                        distance * radius_px
                    ),
                    "a falloff from 0.02 to 2 everywhere in the image (inside image_circle, if there is one)",
                )
            }
            Self::Angle { angles_deg, falloff } => {
                let count = angles_deg.len();
                if !(2..=1024).contains(&count) {
                    return wrong(&["angles_deg"], format!("{count} angles"), "2 to 1024 angles");
                }
                if falloff.len() != count {
                    let message = format!("{} values, but there are {count} angles", falloff.len());
                    return wrong(&["falloff"], message, "one value for each angle");
                }
                let rises = angles_deg.windows(2).position(|pair| !(pair[1] > pair[0] && pair[1] <= 180.0));
                if let Some(at) = rises.map(|at| at + 1).or((angles_deg.first() != Some(&0.0)).then_some(0)) {
                    let message = format!("{}° is out of order", angles_deg[at]);
                    return wrong(
                        &["angles_deg", &at.to_string()],
                        message,
                        "angles rise from 0 to at most 180",
                    );
                }
                let at = falloff.iter().position(|f| !(MIN_FALLOFF..=2.0).contains(f))?;
                wrong(
                    &["falloff", &at.to_string()],
                    format!("`{}` is out of range", falloff[at]),
                    "0.02 to 2",
                )
            }
        }
    }
}

/// 1 + k1·ρ² + k2·ρ⁴ + …
fn radial(coefficients: &[f64], distance: f64) -> f64 {
    let square = distance * distance;
    1.0 + square * coefficients.iter().rev().fold(0.0, |sum, k| sum * square + k)
}

/// Straight between the points, constant outside of them; `xs` rises.
pub(crate) fn interpolate(xs: &[f64], ys: &[f64], x: f64) -> f64 {
    let above = xs.partition_point(|at| *at <= x);
    let at = |i: usize| Some((*xs.get(i)?, *ys.get(i)?));
    match (above.checked_sub(1).and_then(at), at(above)) {
        (Some((x0, y0)), Some((x1, y1))) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        (Some((_, y)), None) | (None, Some((_, y))) => y,
        (None, None) => 1.0,
    }
}
