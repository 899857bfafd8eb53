//! Reflectance of interfaces, and the direction behind them.

use glam::Vec3;

/// What an unpolarised ray meets at a smooth interface of two dielectrics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface {
    /// Share of the power that is reflected.
    pub reflectance: f32,
    /// Cosine of the refracted ray with the normal on its own side; `None` under total internal reflection.
    pub cos_transmitted: Option<f32>,
}

/// Exact Fresnel equations for unpolarised light.
///
/// `cos_incident` in [0, 1] is taken on the ray's own side; `eta` = index behind / index on the ray's side. `eta` = 0
/// reflects everything (glTF's special index of refraction).
pub fn fresnel_dielectric(cos_incident: f32, eta: f32) -> Interface {
    let total = Interface { reflectance: 1.0, cos_transmitted: None };
    let c = cos_incident.clamp(0.0, 1.0);
    // η² cos²θ_t = η² − sin²θ_i, written so that nothing cancels near grazing incidence and near η = 1.
    let squared = (eta - 1.0) * (eta + 1.0) + c * c;
    if !(eta > 0.0 && squared > 0.0) {
        return total;
    }
    let eta_cos_transmitted = squared.sqrt();
    let cos_transmitted = (eta_cos_transmitted / eta).min(1.0);
    let perpendicular = (c - eta_cos_transmitted) / (c + eta_cos_transmitted);
    let parallel = (eta * c - cos_transmitted) / (eta * c + cos_transmitted);
    Interface {
        reflectance: (perpendicular * perpendicular + parallel * parallel) / 2.0,
        cos_transmitted: Some(cos_transmitted),
    }
}

/// Schlick's approximation `F0 + (F90 − F0)(1 − cosθ)⁵`.
pub fn schlick(f0: Vec3, f90: Vec3, cos_incident: f32) -> Vec3 {
    f0 + (f90 - f0) * (1.0 - cos_incident.clamp(0.0, 1.0)).powi(5)
}

/// Grazing reflectance that goes with a normal-incidence reflectance: `saturate(50 F0)`, so that an interface that
/// reflects nothing (index 1) reflects nothing at grazing angles either.
pub fn grazing_reflectance(f0: f32) -> f32 {
    (50.0 * f0).clamp(0.0, 1.0)
}

/// The refracted direction for an incident direction `wo` that points away from the surface, a normal `n` on its side,
/// and the cosine of [`Interface::cos_transmitted`].
pub fn refract(wo: Vec3, n: Vec3, eta: f32, cos_transmitted: f32) -> Vec3 {
    n * (wo.dot(n) / eta - cos_transmitted) - wo / eta
}

/// The mirrored direction of `wo` about `n`.
pub fn reflect(wo: Vec3, n: Vec3) -> Vec3 {
    n * (2.0 * wo.dot(n)) - wo
}
