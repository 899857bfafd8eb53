//! A surface that is partly opaque and partly glass, in constant shares (KHR_materials_transmission between 0 and 1,
//! or a partly metallic glass).

use glam::{Vec2, Vec3};

use super::{Dielectric, Gltf, RoughDielectric, Sample, Transport, choose};

/// `share · glass + (1 − share) · opaque`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    /// Of the glass, in [0, 1].
    pub share: f32,
    /// What is not glass.
    pub opaque: Gltf,
    /// What is.
    pub glass: Glass,
}

/// Smooth or frosted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Glass {
    /// See [`Dielectric`].
    Smooth(Dielectric),
    /// See [`RoughDielectric`].
    Rough(RoughDielectric),
}

impl Mix {
    /// `f · |cosθ|` without delta lobes.
    pub fn eval(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Vec3 {
        let opaque = (1.0 - self.share) * self.opaque.eval(wo, wi);
        match &self.glass {
            Glass::Smooth(_) => opaque,
            Glass::Rough(glass) => opaque + self.share * glass.eval(wo, wi, transport),
        }
    }

    /// Density of [`Mix::sample`] without delta lobes.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let opaque = (1.0 - self.share) * self.opaque.pdf(wo, wi);
        match &self.glass {
            Glass::Smooth(_) => opaque,
            Glass::Rough(glass) => opaque + self.share * glass.pdf(wo, wi),
        }
    }

    /// Chooses one by the shares.
    pub fn sample(&self, wo: Vec3, u2: Vec2, u1: f32, transport: Transport) -> Option<Sample> {
        let (through_glass, u1) = choose(u1, self.share);
        let part = if !through_glass {
            self.opaque.sample(wo, u2, u1)
        } else {
            match &self.glass {
                Glass::Smooth(glass) => glass.sample(wo, u1, transport),
                Glass::Rough(glass) => glass.sample(wo, u2, u1, transport),
            }
        }?;
        if part.is_delta {
            // A delta weight is f/p, and both parts carry the same factor share.
            let chosen = if through_glass { self.share } else { 1.0 - self.share };
            return Some(Sample { pdf: part.pdf * chosen, ..part });
        }
        let pdf = self.pdf(wo, part.wi);
        (pdf > 0.0).then(|| Sample { weight: self.eval(wo, part.wi, transport) / pdf, pdf, ..part })
    }

    /// True if only delta lobes are there.
    pub fn is_delta(&self) -> bool {
        matches!(self.glass, Glass::Smooth(_)) && (self.share >= 1.0 || self.opaque.is_delta())
    }
}
