//! The Trowbridge–Reitz (GGX) microfacet distribution, isotropic.
//!
//! B. Walter et al., *Microfacet Models for Refraction through Rough Surfaces*, EGSR 2007 (D, eq. 33); E. Heitz,
//! *Understanding the Masking-Shadowing Function*, JCGT 3(2), 2014 (Λ, eq. 72; height-correlated G2, eq. 99);
//! E. Heitz, *Sampling the GGX Distribution of Visible Normals*, JCGT 7(4), 2018, in the form of J. Dupuy and
//! A. Benyoub, *Sampling Visible GGX Normals with Spherical Caps*, CGF 42(8), 2023.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

/// Widths below this are taken for smooth: f32 directions do not resolve the lobe, and so do no cameras.
pub const SMOOTH_ALPHA: f32 = 1e-3;

/// A rough surface of width `alpha` (glTF: the square of the roughness).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    /// In [[`SMOOTH_ALPHA`], 1].
    pub alpha: f32,
}

impl Ggx {
    /// Density of microfacet normals `D(h)`, per steradian and projected area.
    pub fn d(&self, h: Vec3) -> f32 {
        if h.z <= 0.0 {
            return 0.0;
        }
        // (x² + y²) rather than 1 − z²: nothing cancels around the normal.
        let a2 = self.alpha * self.alpha;
        let stretched = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
        1.0 / (PI * a2 * stretched * stretched)
    }

    /// Smith's Λ(w) = (−1 + √(1 + α² tan²θ))/2.
    pub fn lambda(&self, w: Vec3) -> f32 {
        let tan2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
        ((1.0 + self.alpha * self.alpha * tan2).sqrt() - 1.0) / 2.0
    }

    /// Masking: share of the microfacets visible from w.
    pub fn g1(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// Height-correlated masking and shadowing, both directions on the same side.
    pub fn g2(&self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(wo) + self.lambda(wi))
    }

    /// Density of visible normals `G1(wo) D(h) max(0, wo·h)/cosθ_o` for `wo` above the surface.
    pub fn visible_normal_pdf(&self, wo: Vec3, h: Vec3) -> f32 {
        self.g1(wo) * self.d(h) * wo.dot(h).max(0.0) / wo.z
    }

    /// Draws a microfacet normal of that density (Dupuy and Benyoub 2023, listing 3).
    pub fn sample_visible_normal(&self, wo: Vec3, u2: Vec2) -> Vec3 {
        let stretched = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize_or(Vec3::Z);
        let z = (1.0 - u2.y) * (1.0 + stretched.z) - stretched.z;
        let sin_theta = (1.0 - z * z).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u2.x).sin_cos();
        let h = Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, z) + stretched;
        Vec3::new(self.alpha * h.x, self.alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
    }

    /// `D G2 / (4 cosθ_o)`: the reflection BRDF times cosθ_i, without Fresnel; both directions above the surface.
    pub fn reflection(&self, wo: Vec3, wi: Vec3, h: Vec3) -> f32 {
        self.d(h) * self.g2(wo, wi) / (4.0 * wo.z)
    }

    /// Density per steradian of the direction mirrored at a visible normal, `D G1 / (4 cosθ_o)`.
    pub fn reflection_pdf(&self, wo: Vec3, h: Vec3) -> f32 {
        self.d(h) * self.g1(wo) / (4.0 * wo.z)
    }
}

/// The half vector of two directions on the same side; `None` if they are opposite.
pub fn half_vector(wo: Vec3, wi: Vec3) -> Option<Vec3> {
    (wo + wi).try_normalize()
}
