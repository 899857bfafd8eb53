//! A smooth dielectric interface: reflection and refraction by the exact Fresnel equations, both delta lobes.
//!
//! Radiance that crosses into a medium of relative index η is squeezed into a smaller solid angle and grows by η²; a
//! camera path is followed backwards, so its weight for refraction carries 1/η² (index behind / index on the path's
//! side). Photons carry power, which is not squeezed (Veach 1997, §5.2.2).

use glam::Vec3;

use super::fresnel::{fresnel_dielectric, refract};
use super::{Sample, ScatterKind, Transport, choose};

/// Smooth glass. z points out of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction of the body (below) / of what surrounds it (above). 0 reflects everything.
    pub eta: f32,
    /// Share of the light entering or leaving that is not absorbed at the interface (glTF's base colour).
    pub tint: Vec3,
    /// An infinitely thin wall: light passes through without being bent, and the medium stays the same.
    pub thin: bool,
}

impl Dielectric {
    /// Reflects with the probability F, else refracts, straight on for a thin wall. Weights are 1 but for tint and,
    /// for radiance, 1/η².
    pub fn sample(&self, wo: Vec3, u1: f32, transport: Transport) -> Option<Sample> {
        if wo.z == 0.0 {
            return None;
        }
        let side = wo.z.signum();
        // A thin wall looks the same from both sides.
        let eta = if side > 0.0 || self.thin || self.eta <= 0.0 { self.eta } else { 1.0 / self.eta };
        let interface = fresnel_dielectric(wo.z.abs(), eta);
        let (reflected, _) = choose(u1, interface.reflectance);
        let cos_transmitted = match interface.cos_transmitted {
            Some(cos_transmitted) if !reflected => cos_transmitted,
            _ => {
                return Some(Sample {
                    wi: Vec3::new(-wo.x, -wo.y, wo.z),
                    weight: Vec3::ONE,
                    pdf: interface.reflectance,
                    is_delta: true,
                    kind: ScatterKind::Reflection,
                });
            }
        };
        let squeeze = match transport {
            Transport::Radiance if !self.thin => 1.0 / (eta * eta),
            _ => 1.0,
        };
        Some(Sample {
            wi: if self.thin { -wo } else { refract(wo, Vec3::Z * side, eta, cos_transmitted) },
            weight: self.tint * squeeze,
            pdf: 1.0 - interface.reflectance,
            is_delta: true,
            kind: if self.thin { ScatterKind::Straight } else { ScatterKind::Refraction },
        })
    }
}
