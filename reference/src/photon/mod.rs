//! Caustics by progressive photon mapping.
//!
//! T. Hachisuka and H. W. Jensen, *Stochastic Progressive Photon Mapping* (2009), in the memoryless form of C. Knaus and
//! M. Zwicker, *Progressive Photon Mapping: A Probabilistic Approach* (2011): every pass traces a photon map of its own and
//! gathers it with a radius that shrinks from pass to pass, `r²ᵢ₊₁ = r²ᵢ (i + α)/(i + 1)`; the mean over the passes
//! converges to the truth.
//!
//! Photons carry the two bits of [`crate::differential`]: a path from a real light is one path until it meets something
//! virtual, where its mixed half is scattered and its real half goes straight on, with the same random numbers. So a real
//! caustic hidden by a virtual blocker is missing in the mixed world only, and caustics that nothing virtual touches are
//! the very same photons in both.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`emit`] | photons from the lights to the surfaces |
//! | [`map`] | finding those near a point |
//! | [`radius`] | how far to look |

pub mod emit;
pub mod map;
pub mod radius;

use coshade_scene::World;
use glam::Vec3;

use crate::differential::Worlds;
pub use emit::{PhotonPaths, trace_photons};
pub use map::PhotonMap;
pub use radius::RadiusSchedule;

/// Light that arrived on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where, world coordinates.
    pub position: Vec3,
    /// Unit direction to where it came from.
    pub wi: Vec3,
    /// Geometric normal of the surface, on the side that was hit.
    pub normal: Vec3,
    /// Its share of all lights' flux.
    pub flux: Vec3,
    /// The worlds in which it arrived.
    pub worlds: Worlds,
    /// The surface's world.
    pub surface: World,
    /// Scattering events between the light and here.
    pub scatterings: u32,
}
