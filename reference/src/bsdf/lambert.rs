//! The perfectly diffuse reflector, `f = ρ/π`.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::{Sample, ScatterKind};

/// A diffuse reflector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// Share of the light that is reflected, each part in [0, 1].
    pub albedo: Vec3,
}

impl Lambert {
    /// `f · cosθ`.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.albedo * self.pdf(wo, wi)
    }

    /// `cosθ/π` above the surface.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wo.z > 0.0 { wi.z.max(0.0) * FRAC_1_PI } else { 0.0 }
    }

    /// By the cosine; the weight is the albedo.
    pub fn sample(&self, wo: Vec3, u2: Vec2) -> Option<Sample> {
        let wi = sample_cosine_hemisphere(u2);
        if wo.z <= 0.0 || wi.z <= 0.0 || self.albedo == Vec3::ZERO {
            return None;
        }
        Some(Sample {
            wi,
            weight: self.albedo,
            pdf: self.pdf(wo, wi),
            is_delta: false,
            kind: ScatterKind::Diffuse,
        })
    }
}

/// A direction of density `cosθ/π` around +z.
pub fn sample_cosine_hemisphere(u2: Vec2) -> Vec3 {
    // cosθ = √(1 − u): never 0 for u < 1.
    let (sin_theta, cos_theta) = (u2.x.sqrt(), (1.0 - u2.x).sqrt());
    let (sin_phi, cos_phi) = (TAU * u2.y).sin_cos();
    Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
}
