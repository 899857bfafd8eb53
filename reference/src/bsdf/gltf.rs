//! glTF 2.0 metallic-roughness, as its appendix B computes it.
//!
//! ```text
//! dielectric = (1 − F(v·h)) · base/π + F(v·h) · D G2/(4 cosθ_i cosθ_o),   F = Schlick(F0, F90 = saturate(50 F0))
//! metal      = Schlick(base, 1)(v·h) · D G2/(4 cosθ_i cosθ_o)
//! f          = mix(dielectric, metal, metallic)
//! ```
//!
//! With an index of refraction of 1 the coat vanishes and a pure Lambert reflector is left. A width below
//! [`SMOOTH_ALPHA`] is a mirror: the specular part becomes a delta lobe with the same Schlick factors, taken at v·n.

use glam::{Vec2, Vec3};

use super::fresnel::{grazing_reflectance, reflect, schlick};
use super::ggx::{Ggx, SMOOTH_ALPHA, half_vector};
use super::lambert::{Lambert, sample_cosine_hemisphere};
use super::{Sample, ScatterKind, choose, luminance};

/// An opaque surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gltf {
    /// Albedo of the dielectric, F0 of the metal.
    pub base: Vec3,
    /// 0 dielectric … 1 metal.
    pub metallic: f32,
    /// Normal-incidence reflectance of the dielectric's coat.
    pub f0: f32,
    /// GGX width; below [`SMOOTH_ALPHA`] smooth.
    pub alpha: f32,
}

impl Gltf {
    /// A metal of this normal-incidence reflectance.
    pub fn metal(f0: Vec3, alpha: f32) -> Self {
        Self { base: f0, metallic: 1.0, f0: 0.0, alpha }
    }

    /// `f · cosθ` without the delta lobe.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Vec3::ZERO;
        }
        let Some(h) = half_vector(wo, wi) else {
            return Vec3::ZERO;
        };
        let cos_half = wo.dot(h);
        let diffuse = self.diffuse_share(cos_half) * Lambert { albedo: self.base }.eval(wo, wi);
        match self.rough() {
            Some(ggx) => diffuse + self.specular_fresnel(cos_half) * ggx.reflection(wo, wi, h),
            None => diffuse,
        }
    }

    /// Density of the directions drawn by [`Gltf::sample`], without the delta lobe.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let p_specular = self.specular_probability(wo);
        let diffuse = (1.0 - p_specular) * Lambert { albedo: self.base }.pdf(wo, wi);
        match (self.rough(), half_vector(wo, wi)) {
            (Some(ggx), Some(h)) => diffuse + p_specular * ggx.reflection_pdf(wo, h),
            _ => diffuse,
        }
    }

    /// Visible normals or the cosine, chosen by the share of light each reflects from `wo`.
    pub fn sample(&self, wo: Vec3, u2: Vec2, u1: f32) -> Option<Sample> {
        if wo.z <= 0.0 {
            return None;
        }
        let p_specular = self.specular_probability(wo);
        let (specular, _) = choose(u1, p_specular);
        let (wi, kind) = match (specular, self.rough()) {
            (true, None) => return self.mirror_sample(wo, p_specular),
            (true, Some(ggx)) => (reflect(wo, ggx.sample_visible_normal(wo, u2)), ScatterKind::Glossy),
            (false, _) => (sample_cosine_hemisphere(u2), ScatterKind::Diffuse),
        };
        let pdf = self.pdf(wo, wi);
        let value = self.eval(wo, wi);
        (wi.z > 0.0 && pdf > 0.0 && value.max_element() > 0.0).then(|| Sample {
            wi,
            weight: value / pdf,
            pdf,
            is_delta: false,
            kind,
        })
    }

    /// True if only the delta lobe is there.
    pub fn is_delta(&self) -> bool {
        self.rough().is_none() && (self.metallic >= 1.0 || self.base == Vec3::ZERO)
    }

    fn mirror_sample(&self, wo: Vec3, p_specular: f32) -> Option<Sample> {
        let reflectance = self.specular_fresnel(wo.z);
        (reflectance.max_element() > 0.0).then(|| Sample {
            wi: Vec3::new(-wo.x, -wo.y, wo.z),
            weight: reflectance / p_specular,
            pdf: p_specular,
            is_delta: true,
            kind: ScatterKind::Reflection,
        })
    }

    fn rough(&self) -> Option<Ggx> {
        (self.alpha >= SMOOTH_ALPHA).then_some(Ggx { alpha: self.alpha })
    }

    fn coat_fresnel(&self, cos_half: f32) -> f32 {
        let f90 = grazing_reflectance(self.f0);
        schlick(Vec3::splat(self.f0), Vec3::splat(f90), cos_half).x
    }

    fn diffuse_share(&self, cos_half: f32) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.coat_fresnel(cos_half))
    }

    fn specular_fresnel(&self, cos_half: f32) -> Vec3 {
        let metal = schlick(self.base, Vec3::ONE, cos_half);
        Vec3::splat((1.0 - self.metallic) * self.coat_fresnel(cos_half)) + self.metallic * metal
    }

    /// Share of the reflected light that is specular, estimated for a mirror. A rough lobe keeps at least 10 % of the
    /// samples: at normal incidence its Fresnel factor says little about grazing half vectors.
    fn specular_probability(&self, wo: Vec3) -> f32 {
        let specular = luminance(self.specular_fresnel(wo.z));
        let diffuse = luminance(self.base) * self.diffuse_share(wo.z);
        if diffuse <= 0.0 {
            return 1.0;
        }
        if specular <= 0.0 {
            return 0.0;
        }
        let share = specular / (specular + diffuse);
        if self.rough().is_some() { share.clamp(0.1, 0.9) } else { share }
    }
}
