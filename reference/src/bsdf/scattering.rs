//! A BSDF placed on a surface.
//!
//! Shading normals (interpolated or mapped) are not the surface's own, and two things follow (Veach 1997, §5.3):
//! whether light is reflected or transmitted is decided by the *geometric* normal, or light would leak through; and
//! photons need the factor `|wo·n_s| |wi·n_g| / (|wo·n_g| |wi·n_s|)` (eq. 5.19), or their light would be shaded
//! differently from the camera's.

use glam::{Vec2, Vec3};

use super::{Bsdf, Frame, Sample, Transport};

/// A BSDF in world coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattering {
    /// In the frame's local coordinates.
    pub bsdf: Bsdf,
    /// Around the shading normal.
    pub frame: Frame,
    /// On the side of the shading normal.
    pub geometric_normal: Vec3,
}

impl Scattering {
    /// `f(wo, wi) · |cosθ_i|` (with the shading normal's cosine), for photons times the correction; no delta lobes.
    pub fn eval(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Vec3 {
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        if !self.sides_agree(wo, local_o) || !self.sides_agree(wi, local_i) {
            return Vec3::ZERO;
        }
        self.bsdf.eval(local_o, local_i, transport) * self.correction(wo, wi, transport)
    }

    /// Density per steradian with which [`Scattering::sample`] yields `wi`.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        if !self.sides_agree(wo, local_o) || !self.sides_agree(wi, local_i) {
            return 0.0;
        }
        self.bsdf.pdf(local_o, local_i)
    }

    /// As [`Bsdf::sample`]; `None` also where the shading normal would send light through an opaque surface.
    pub fn sample(&self, wo: Vec3, u2: Vec2, u1: f32, transport: Transport) -> Option<Sample> {
        let local_o = self.frame.to_local(wo);
        if !self.sides_agree(wo, local_o) {
            return None;
        }
        let sample = self.bsdf.sample(local_o, u2, u1, transport)?;
        let wi = self.frame.to_world(sample.wi).normalize_or_zero();
        self.sides_agree(wi, sample.wi).then(|| Sample {
            wi,
            weight: sample.weight * self.correction(wo, wi, transport),
            ..sample
        })
    }

    fn sides_agree(&self, world: Vec3, local: Vec3) -> bool {
        world.dot(self.geometric_normal) * local.z > 0.0
    }

    fn correction(&self, wo: Vec3, wi: Vec3, transport: Transport) -> f32 {
        let (n_s, n_g) = (self.frame.normal, self.geometric_normal);
        if transport == Transport::Radiance || n_s == n_g {
            return 1.0;
        }
        ((wo.dot(n_s) * wi.dot(n_g)) / (wo.dot(n_g) * wi.dot(n_s))).abs()
    }
}
