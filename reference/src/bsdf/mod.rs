//! How surfaces scatter light.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`frame`] | the local frame all of them are written in |
//! | [`fresnel`] | exact Fresnel equations, Schlick's approximation, refraction |
//! | [`lambert`] | perfectly diffuse |
//! | [`ggx`] | the Trowbridge–Reitz microfacet distribution |
//! | [`gltf`] | metallic-roughness: Lambert under a GGX coat, mixed with a GGX metal |
//! | [`phong`] | normalised modified Phong, for comparison with the papers |
//! | [`dielectric`] | smooth glass, solid or thin-walled |
//! | [`rough_dielectric`] | frosted glass |
//! | [`mix`] | partly opaque, partly glass |
//! | [`scattering`] | a BSDF placed on a surface: world directions, shading normals, the adjoint |
//! | [`medium`] | absorption, and which bodies a path is inside of |
//!
//! In this module's local frame z is the shading normal, all directions are unit vectors that point *away* from the
//! surface, `wo` is the known one (where the path came from) and `wi` the one it goes on to.

pub mod dielectric;
pub mod frame;
pub mod fresnel;
pub mod ggx;
pub mod gltf;
pub mod lambert;
pub mod medium;
pub mod mix;
pub mod phong;
pub mod rough_dielectric;
pub mod scattering;

use glam::{Vec2, Vec3};

pub use dielectric::Dielectric;
pub use frame::Frame;
pub use gltf::Gltf;
pub use lambert::Lambert;
pub use medium::{BodyId, Interior, Medium, transmittance};
pub use mix::Mix;
pub use phong::Phong;
pub use rough_dielectric::RoughDielectric;
pub use scattering::Scattering;

/// What a path carries towards `wo`.
///
/// Refraction squeezes radiance into the solid angle of the denser side, but no photon is gained or lost: the two need
/// different factors (Veach 1997, §5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Paths from the camera.
    Radiance,
    /// Photons from the lights: the adjoint BSDF.
    Importance,
}

/// What happened at a scattering event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScatterKind {
    /// Lambertian.
    Diffuse,
    /// A lobe of finite width that stays on the same side.
    Glossy,
    /// A lobe of finite width to the other side: the path enters or leaves the body.
    GlossyRefraction,
    /// As by a mirror.
    Reflection,
    /// Into or out of the body, bent.
    Refraction,
    /// Through a thin wall: the medium stays the same.
    Straight,
    /// Through a frosted thin wall: a lobe of finite width to the other side, the medium stays the same.
    GlossyStraight,
}

impl ScatterKind {
    /// True where the path changes the medium, see [`Interior::cross`].
    pub fn crosses_boundary(self) -> bool {
        matches!(self, Self::Refraction | Self::GlossyRefraction)
    }
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Where the path goes on; unit length.
    pub wi: Vec3,
    /// `f · |cosθ| / pdf`, what the path's throughput is multiplied by.
    pub weight: Vec3,
    /// Density per steradian of all ways to get this direction; of a delta sample the probability of having chosen it.
    pub pdf: f32,
    /// True where the direction was the only possible one: eval and pdf do not contain it, no light sampling can hit it.
    pub is_delta: bool,
    /// What happened.
    pub kind: ScatterKind,
}

/// A BSDF in its local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Absorbs everything.
    Black,
    /// See [`lambert`].
    Lambert(Lambert),
    /// See [`gltf`].
    Gltf(Gltf),
    /// See [`phong`].
    Phong(Phong),
    /// See [`dielectric`].
    Dielectric(Dielectric),
    /// See [`rough_dielectric`].
    RoughDielectric(RoughDielectric),
    /// See [`mix`].
    Mix(Mix),
}

impl Bsdf {
    /// `f(wo, wi) · |cosθ_i|` without delta lobes.
    pub fn eval(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Vec3 {
        match self {
            Self::Black => Vec3::ZERO,
            Self::Lambert(lambert) => lambert.eval(wo, wi),
            Self::Gltf(gltf) => gltf.eval(wo, wi),
            Self::Phong(phong) => phong.eval(wo, wi),
            Self::Dielectric(_) => Vec3::ZERO,
            Self::RoughDielectric(glass) => glass.eval(wo, wi, transport),
            Self::Mix(mix) => mix.eval(wo, wi, transport),
        }
    }

    /// Density per steradian with which [`Bsdf::sample`] yields `wi`, without delta lobes.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Black => 0.0,
            Self::Lambert(lambert) => lambert.pdf(wo, wi),
            Self::Gltf(gltf) => gltf.pdf(wo, wi),
            Self::Phong(phong) => phong.pdf(wo, wi),
            Self::Dielectric(_) => 0.0,
            Self::RoughDielectric(glass) => glass.pdf(wo, wi),
            Self::Mix(mix) => mix.pdf(wo, wi),
        }
    }

    /// Draws a direction: `u2` places it within a lobe, `u1` chooses the lobe. `None` where the path ends: nothing is
    /// scattered, or the drawn direction lies below the surface.
    pub fn sample(&self, wo: Vec3, u2: Vec2, u1: f32, transport: Transport) -> Option<Sample> {
        match self {
            Self::Black => None,
            Self::Lambert(lambert) => lambert.sample(wo, u2),
            Self::Gltf(gltf) => gltf.sample(wo, u2, u1),
            Self::Phong(phong) => phong.sample(wo, u2, u1),
            Self::Dielectric(glass) => glass.sample(wo, u1, transport),
            Self::RoughDielectric(glass) => glass.sample(wo, u2, u1, transport),
            Self::Mix(mix) => mix.sample(wo, u2, u1, transport),
        }
    }

    /// True if nothing but delta lobes is there: light sampling is useless.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Black | Self::Lambert(_) | Self::RoughDielectric(_) => false,
            Self::Gltf(gltf) => gltf.is_delta(),
            Self::Phong(phong) => phong.is_delta(),
            Self::Dielectric(_) => true,
            Self::Mix(mix) => mix.is_delta(),
        }
    }
}

/// Relative luminance of linear Rec. 709 RGB, by which lobes and lights are chosen.
pub fn luminance(colour: Vec3) -> f32 {
    colour.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// A number in [0, 1) and the choice it makes: with probability `p` the first, else the second; what is left of the
/// number is uniform again.
fn choose(u: f32, p: f32) -> (bool, f32) {
    /// The largest f32 below 1.
    const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
    if u < p { (true, (u / p).min(BELOW_ONE)) } else { (false, ((u - p) / (1.0 - p)).min(BELOW_ONE)) }
}

#[cfg(test)]
mod tests;
