//! Lights, as written in a session.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::placement::PoseSpec;
use crate::light::DEFAULT_SPOT_RADIUS_M;
use crate::world::World;

/// A described light. All have an area. In its own frame a light lies at the origin and shines towards +z, as a lamp on
/// a tag does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LightSpec {
    /// For messages; unique if given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Whether the camera image contains its light already.
    pub world: World,
    /// Where it is. Left out: at the world's origin, shining up.
    #[serde(default)]
    pub pose: PoseSpec,
    /// Measure its strength from the fish-eye image instead of giving it. Real lights only.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub fit: bool,
    /// Its form and strength.
    #[serde(flatten)]
    pub kind: LightKindSpec,
}

/// Forms of lights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum LightKindSpec {
    /// A disc that shines into a cone.
    Spot {
        /// Red, green and blue on the axis, radiance unit × m². Needed unless `fit = true`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(inner(range(min = 0.0)))]
        radiant_intensity: Option<[f64; 3]>,
        /// Angles from the axis: full strength up to the first, none beyond the second.
        #[schemars(inner(range(min = 0.0, max = 90.0)))]
        cone_deg: [f64; 2],
        /// Of the disc. Higher: softer shadows.
        #[serde(default = "spot_radius_m")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius_m: f64,
    },
    /// A rectangle that shines to one side, the same in all directions.
    Area {
        /// Along its x and y.
        size_m: [f64; 2],
        /// Red, green and blue. Needed unless `fit = true`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(inner(range(min = 0.0)))]
        radiance: Option<[f64; 3]>,
    },
}

/// The default as the decimal number it stands for.
fn spot_radius_m() -> f64 {
    (f64::from(DEFAULT_SPOT_RADIUS_M) * 1e6).round() / 1e6
}
