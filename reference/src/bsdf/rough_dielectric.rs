//! A rough dielectric interface (Walter et al. 2007): GGX microfacets that each reflect and refract by the exact
//! Fresnel equations.
//!
//! Reflection as in [`super::ggx`]; refraction (their eq. 21, times |cosθ_i|, for radiance; photons lack the 1/η²):
//!
//! ```text
//! f |cosθ_i| = |wi·h| |wo·h| / cosθ_o · (1 − F) D G2 / (wo·h + η wi·h)²,   h ∥ −(wo + η wi)
//! ```

use glam::{Vec2, Vec3};

use super::fresnel::{fresnel_dielectric, reflect, refract};
use super::ggx::{Ggx, half_vector};
use super::{Sample, ScatterKind, Transport, choose};

/// Frosted glass. z points out of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    /// Index of refraction of the body (below) / of what surrounds it (above); positive.
    pub eta: f32,
    /// Share of the light entering or leaving that is not absorbed at the interface.
    pub tint: Vec3,
    /// GGX width, at least [`super::ggx::SMOOTH_ALPHA`].
    pub alpha: f32,
    /// An infinitely thin wall: the transmitted lobe is the reflected one, mirrored at the surface (glTF).
    pub thin: bool,
}

/// A pair of directions seen from the side of `wo`, with the microfacet that connects them.
struct Facet {
    wo: Vec3,
    wi: Vec3,
    h: Vec3,
    eta: f32,
    reflects: bool,
}

impl RoughDielectric {
    /// `f · |cosθ|`.
    pub fn eval(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Vec3 {
        let Some(facet) = self.facet(wo, wi) else {
            return Vec3::ZERO;
        };
        let Facet { wo, wi, h, eta, .. } = facet;
        let ggx = self.ggx();
        let reflectance = fresnel_dielectric(wo.dot(h), eta).reflectance;
        // Smith's Λ is even, so it serves directions on either side.
        let common = ggx.d(h) * ggx.g2(wo, wi) / wo.z;
        if facet.reflects {
            return Vec3::splat(reflectance * common / 4.0);
        }
        if self.thin {
            return self.tint * ((1.0 - reflectance) * common / 4.0);
        }
        let squeeze = match transport {
            Transport::Radiance => 1.0 / (eta * eta),
            Transport::Importance => 1.0,
        };
        self.tint * ((1.0 - reflectance) * common * wo.dot(h) * facet.jacobian() * squeeze)
    }

    /// Density per steradian.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Some(facet) = self.facet(wo, wi) else {
            return 0.0;
        };
        let Facet { wo, h, eta, .. } = facet;
        let ggx = self.ggx();
        let reflectance = fresnel_dielectric(wo.dot(h), eta).reflectance;
        if facet.reflects {
            reflectance * ggx.reflection_pdf(wo, h)
        } else if self.thin {
            (1.0 - reflectance) * ggx.reflection_pdf(wo, h)
        } else {
            (1.0 - reflectance) * ggx.visible_normal_pdf(wo, h) * facet.jacobian()
        }
    }

    /// Draws a visible microfacet, then reflects or refracts by its Fresnel factor.
    pub fn sample(&self, wo: Vec3, u2: Vec2, u1: f32, transport: Transport) -> Option<Sample> {
        if wo.z == 0.0 {
            return None;
        }
        let side = wo.z.signum();
        let local = wo * Vec3::new(1.0, 1.0, side);
        let eta = self.eta_from(side);
        let h = self.ggx().sample_visible_normal(local, u2);
        let interface = fresnel_dielectric(local.dot(h), eta);
        let (reflected, _) = choose(u1, interface.reflectance);
        let (wi, kind) = match interface.cos_transmitted {
            Some(cos) if !reflected => (self.transmitted(local, h, eta, cos), self.transmitted_kind()),
            _ => (reflect(local, h), ScatterKind::Glossy),
        };
        let stays = kind == ScatterKind::Glossy;
        if (wi.z > 0.0) != stays || wi.z == 0.0 {
            return None;
        }
        let wi = wi * Vec3::new(1.0, 1.0, side);
        let (value, pdf) = (self.eval(wo, wi, transport), self.pdf(wo, wi));
        (pdf > 0.0 && value.max_element() > 0.0).then(|| Sample {
            wi,
            weight: value / pdf,
            pdf,
            is_delta: false,
            kind,
        })
    }

    fn ggx(&self) -> Ggx {
        Ggx { alpha: self.alpha }
    }

    fn eta_from(&self, side: f32) -> f32 {
        if side > 0.0 || self.thin { self.eta } else { 1.0 / self.eta }
    }

    fn transmitted(&self, wo: Vec3, h: Vec3, eta: f32, cos_transmitted: f32) -> Vec3 {
        if self.thin {
            reflect(wo, h) * Vec3::new(1.0, 1.0, -1.0)
        } else {
            refract(wo, h, eta, cos_transmitted).normalize_or(-wo)
        }
    }

    fn transmitted_kind(&self) -> ScatterKind {
        // A frosted thin wall scatters to the other side, but leaves the medium as it is.
        if self.thin { ScatterKind::GlossyStraight } else { ScatterKind::GlossyRefraction }
    }

    fn facet(&self, wo: Vec3, wi: Vec3) -> Option<Facet> {
        let side = wo.z.signum();
        let flip = Vec3::new(1.0, 1.0, side);
        let (wo, wi) = (wo * flip, wi * flip);
        if wo.z <= 0.0 || wi.z == 0.0 {
            return None;
        }
        let eta = self.eta_from(side);
        let reflects = wi.z > 0.0;
        let h = match (reflects, self.thin) {
            (true, _) => half_vector(wo, wi)?,
            (false, true) => half_vector(wo, wi * Vec3::new(1.0, 1.0, -1.0))?,
            (false, false) => {
                let h = (wo + eta * wi).try_normalize()?;
                h * h.z.signum()
            }
        };
        let transmits = !reflects && !self.thin;
        let valid = wo.dot(h) > 0.0 && (!transmits || wi.dot(h) < 0.0);
        valid.then_some(Facet { wo, wi, h, eta, reflects })
    }
}

impl Facet {
    /// |∂h/∂wi| of refraction, `η² |wi·h|/(wo·h + η wi·h)²` (Walter et al. 2007, eq. 17).
    fn jacobian(&self) -> f32 {
        let (cos_o, cos_i) = (self.wo.dot(self.h), self.wi.dot(self.h));
        let denominator = cos_o + self.eta * cos_i;
        self.eta * self.eta * cos_i.abs() / (denominator * denominator)
    }
}
