//! A right-handed orthonormal frame around a normal.

use glam::Vec3;

/// Local coordinates x, y, z are along `tangent`, `bitangent`, `normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x.
    pub tangent: Vec3,
    /// Local y.
    pub bitangent: Vec3,
    /// Local z.
    pub normal: Vec3,
}

impl Frame {
    /// Around a unit normal, turned in some way (Duff et al. 2017).
    pub fn around(normal: Vec3) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        Self { tangent, bitangent, normal }
    }

    /// Around a unit normal, local x as close to `tangent` as possible (in some direction if that is along the normal).
    pub fn with_tangent(normal: Vec3, tangent: Vec3) -> Self {
        match (tangent - normal * normal.dot(tangent)).try_normalize() {
            Some(tangent) => Self { tangent, bitangent: normal.cross(tangent), normal },
            None => Self::around(normal),
        }
    }

    /// The same for `side` = 1, seen from the other side for −1 (normal and bitangent turned).
    pub fn facing(&self, side: f32) -> Self {
        Self { tangent: self.tangent, bitangent: self.bitangent * side, normal: self.normal * side }
    }

    /// World to local.
    pub fn to_local(&self, world: Vec3) -> Vec3 {
        Vec3::new(world.dot(self.tangent), world.dot(self.bitangent), world.dot(self.normal))
    }

    /// Local to world.
    pub fn to_world(&self, local: Vec3) -> Vec3 {
        self.tangent * local.x + self.bitangent * local.y + self.normal * local.z
    }
}
