//! Rigid poses in double precision: what the truth is told in.

use coshade_scene::Similarity;
use glam::{DQuat, DVec3};

/// `a_from_b` without a scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Where b's origin is in a, metres.
    pub position_m: DVec3,
}

impl Rigid {
    /// Changes nothing.
    pub const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, position_m: DVec3::ZERO };

    /// Maps a point.
    pub fn transform_point(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.position_m
    }

    /// `b_from_a`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self { rotation, position_m: rotation * -self.position_m }
    }

    /// In single precision.
    pub fn similarity(&self) -> Similarity {
        Similarity { rotation: self.rotation.as_quat(), translation_m: self.position_m.as_vec3(), scale: 1.0 }
    }
}

impl From<nalgebra::Isometry3<f64>> for Rigid {
    fn from(a_from_b: nalgebra::Isometry3<f64>) -> Self {
        let vector = a_from_b.translation.vector;
        Self {
            rotation: DQuat::from_array(a_from_b.rotation.coords.into()),
            position_m: DVec3::new(vector.x, vector.y, vector.z),
        }
    }
}

impl std::ops::Mul for Rigid {
    type Output = Self;

    /// `a_from_b * b_from_c = a_from_c`.
    fn mul(self, b_from_c: Self) -> Self {
        Self {
            rotation: (self.rotation * b_from_c.rotation).normalize(),
            position_m: self.transform_point(b_from_c.position_m),
        }
    }
}
