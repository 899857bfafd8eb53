//! Whether something exists in the room or only in the composite.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Membership of a thing or a light: the camera sees only real ones, the composite shows both.
///
/// This is about objects. Whether a *light path* exists in the real or in the mixed world is the renderer's business.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum World {
    /// Stands in front of the camera; the model here only describes it.
    Real,
    /// Is drawn.
    Virtual,
}

impl World {
    /// True for [`World::Real`].
    pub fn is_real(self) -> bool {
        self == Self::Real
    }
}
