//! Rays and hits.

use glam::Vec3;

/// What a ray can hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sees {
    /// The mixed world: real and virtual things.
    Everything,
    /// The real world: virtual things are not there.
    RealOnly,
}

/// A ray: the points `origin + t · direction` with t_min < t < t_max.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, metres.
    pub origin: Vec3,
    /// Where it goes; any length, t counts in it.
    pub direction: Vec3,
    /// Nearest t, usually 0: origins are offset from surfaces instead, see [`super::offset`].
    pub t_min: f32,
    /// Farthest t.
    pub t_max: f32,
    /// Decides at surfaces of fractional alpha. The same seed decides the same way at the same triangle, so one ray cast
    /// into both worlds meets the same holes.
    pub seed: u32,
}

impl Ray {
    /// Without end.
    pub fn new(origin: Vec3, direction: Vec3, seed: u32) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY, seed }
    }

    /// The open segment between two points, of which t is the fraction. Ends on surfaces must be offset.
    pub fn between(origin: Vec3, target: Vec3, seed: u32) -> Self {
        Self { t_max: 1.0, ..Self::new(origin, target - origin, seed) }
    }

    /// The point at t.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Where a ray met a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// In units of the ray's direction.
    pub t: f32,
    /// Number within [`super::Geometry`].
    pub triangle: u32,
    /// Weights of the three corners, each ≥ 0, of sum 1.
    pub barycentric: Vec3,
}
