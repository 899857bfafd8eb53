//! The modified Phong model, normalised (E. Lafortune and Y. Willems, *Using the Modified Phong Reflectance Model for
//! Physically Based Rendering*, 1994, eqs. 4, 8 and 9): `f = k_d/π + k_s (n + 2)/(2π) cosⁿα`, α the angle between `wi`
//! and the mirrored `wo`; k_d + k_s ≤ 1.
//!
//! The exponent comes from the GGX width, n = 2/α² − 2 ([`coshade_scene::material::phong_exponent`]).

use std::f32::consts::TAU;

use coshade_scene::material::phong_exponent;
use glam::{Vec2, Vec3};

use super::ggx::SMOOTH_ALPHA;
use super::lambert::{Lambert, sample_cosine_hemisphere};
use super::{Frame, Sample, ScatterKind, choose, luminance};

/// Diffuse plus a cosine-power lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// Diffuse reflectance.
    pub diffuse: Vec3,
    /// Specular reflectance at normal incidence; diffuse + specular ≤ 1.
    pub specular: Vec3,
    /// GGX width; below [`SMOOTH_ALPHA`] a mirror.
    pub alpha: f32,
}

impl Phong {
    /// The Phong surface closest to a glTF one: the specular part is the normal-incidence reflectance, the diffuse part
    /// what it leaves.
    pub fn from_gltf(gltf: &super::Gltf) -> Self {
        let coat = Vec3::splat(gltf.f0);
        Self {
            diffuse: gltf.base * ((1.0 - gltf.metallic) * (1.0 - gltf.f0)),
            specular: coat.lerp(gltf.base, gltf.metallic),
            alpha: gltf.alpha,
        }
    }

    /// `f · cosθ` without the delta lobe.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        let diffuse = Lambert { albedo: self.diffuse }.eval(wo, wi);
        match self.exponent() {
            Some(n) => diffuse + self.specular * ((n + 2.0) / TAU * lobe(wo, wi, n) * wi.z),
            None => diffuse,
        }
    }

    /// Density of the directions drawn by [`Phong::sample`], without the delta lobe.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let p_specular = self.specular_probability();
        let diffuse = (1.0 - p_specular) * Lambert { albedo: self.diffuse }.pdf(wo, wi);
        match self.exponent() {
            Some(n) => diffuse + p_specular * (n + 1.0) / TAU * lobe(wo, wi, n),
            None => diffuse,
        }
    }

    /// Around the mirrored direction or by the cosine. `None` also where the lobe reaches below the surface.
    pub fn sample(&self, wo: Vec3, u2: Vec2, u1: f32) -> Option<Sample> {
        if wo.z <= 0.0 || (self.diffuse + self.specular).max_element() <= 0.0 {
            return None;
        }
        let p_specular = self.specular_probability();
        let (specular, _) = choose(u1, p_specular);
        let mirrored = Vec3::new(-wo.x, -wo.y, wo.z);
        let (wi, kind) = match (specular, self.exponent()) {
            (true, None) => {
                return Some(Sample {
                    wi: mirrored,
                    weight: self.specular / p_specular,
                    pdf: p_specular,
                    is_delta: true,
                    kind: ScatterKind::Reflection,
                });
            }
            (true, Some(n)) => (Frame::around(mirrored).to_world(sample_lobe(u2, n)), ScatterKind::Glossy),
            (false, _) => (sample_cosine_hemisphere(u2), ScatterKind::Diffuse),
        };
        let pdf = self.pdf(wo, wi);
        (wi.z > 0.0 && pdf > 0.0).then(|| Sample {
            wi,
            weight: self.eval(wo, wi) / pdf,
            pdf,
            is_delta: false,
            kind,
        })
    }

    /// True if only the delta lobe is there.
    pub fn is_delta(&self) -> bool {
        self.exponent().is_none() && self.diffuse == Vec3::ZERO
    }

    fn exponent(&self) -> Option<f32> {
        (self.alpha >= SMOOTH_ALPHA).then(|| phong_exponent(self.alpha).max(0.0))
    }

    fn specular_probability(&self) -> f32 {
        let (specular, diffuse) = (luminance(self.specular), luminance(self.diffuse));
        if specular <= 0.0 { 0.0 } else { specular / (specular + diffuse) }
    }
}

/// `cosⁿα`, from the chord between the directions so that narrow lobes keep their digits: cosα = 1 − chord²/2.
fn lobe(wo: Vec3, wi: Vec3, n: f32) -> f32 {
    let half_chord2 = (wi - Vec3::new(-wo.x, -wo.y, wo.z)).length_squared() / 2.0;
    if half_chord2 >= 1.0 {
        return 0.0;
    }
    (n * (-half_chord2).ln_1p()).exp()
}

/// A direction of density (n + 1)/2π cosⁿα around +z: cosα = u^(1/(n+1)).
fn sample_lobe(u2: Vec2, n: f32) -> Vec3 {
    // 1 − u in (0, 1]; ln and expm1 keep 1 − cosα exact where it is tiny.
    let one_minus_cos = -((1.0 - u2.x).ln() / (n + 1.0)).exp_m1();
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u2.y).sin_cos();
    Vec3::new(sin * cos_phi, sin * sin_phi, 1.0 - one_minus_cos)
}
