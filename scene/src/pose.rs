//! Where a thing is.

use std::ops::Mul;
use std::path::PathBuf;

use glam::{Mat4, Quat, Vec3};

/// A rigid transform with a uniform scale: `a_from_b(p) = rotation · (scale · p) + translation_m`.
///
/// Non-uniform scales (of a glTF node, say) are baked into the mesh at import, so that a thing's shape never depends
/// on its pose and normals turn with the rotation alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Unit quaternion.
    pub rotation: Quat,
    /// Where b's origin is in a, metres.
    pub translation_m: Vec3,
    /// Uniform, positive.
    pub scale: f32,
}

impl Default for Similarity {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Similarity {
    /// Changes nothing.
    pub const IDENTITY: Self = Self { rotation: Quat::IDENTITY, translation_m: Vec3::ZERO, scale: 1.0 };

    /// A pure translation, metres.
    pub fn from_translation(translation_m: Vec3) -> Self {
        Self { translation_m, ..Self::IDENTITY }
    }

    /// A pure rotation.
    pub fn from_rotation(rotation: Quat) -> Self {
        Self { rotation, ..Self::IDENTITY }
    }

    /// A pure scale.
    pub fn from_scale(scale: f32) -> Self {
        Self { scale, ..Self::IDENTITY }
    }

    /// True if all numbers are finite, the scale is positive and the quaternion has unit length (to 1e-3).
    pub fn is_valid(&self) -> bool {
        let unit = (self.rotation.length_squared() - 1.0).abs() < 1e-3;
        unit && self.translation_m.is_finite() && self.scale.is_finite() && self.scale > 0.0
    }

    /// Maps a point.
    #[inline]
    pub fn transform_point(&self, point: Vec3) -> Vec3 {
        self.rotation * (self.scale * point) + self.translation_m
    }

    /// Maps a direction or a normal: rotated only, so a unit vector stays one.
    #[inline]
    pub fn transform_direction(&self, direction: Vec3) -> Vec3 {
        self.rotation * direction
    }

    /// `b_from_a`.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        let scale = 1.0 / self.scale;
        Self { rotation, translation_m: rotation * (-scale * self.translation_m), scale }
    }

    /// As a 4×4 matrix for column vectors.
    pub fn to_mat4(&self) -> Mat4 {
        Mat4::from_scale_rotation_translation(Vec3::splat(self.scale), self.rotation, self.translation_m)
    }
}

impl Mul for Similarity {
    type Output = Self;

    /// `a_from_b * b_from_c = a_from_c`.
    fn mul(self, b_from_c: Self) -> Self {
        Self {
            rotation: self.rotation * b_from_c.rotation,
            translation_m: self.transform_point(b_from_c.translation_m),
            scale: self.scale * b_from_c.scale,
        }
    }
}

/// The pose of a thing or a light, in the frame of what it is attached to.
///
/// Tag and board frames: x right, y up along the print, z out of the paper, origin at its centre.
#[derive(Clone, Debug, PartialEq)]
pub enum Pose {
    /// Fixed in the world.
    World(Similarity),
    /// Attached to one tag.
    Marker {
        /// Tag family, such as `tag36h11`.
        family: String,
        /// Number of the tag within its family.
        id: u32,
        /// Side of the square through the tag's four detected corners, metres.
        size_m: f32,
        /// Thing to tag frame.
        marker_from_thing: Similarity,
    },
    /// Attached to a rigid body that carries several tags.
    Body {
        /// File that describes the body.
        body: PathBuf,
        /// Thing to body frame.
        body_from_thing: Similarity,
    },
    /// Attached to a printed board.
    Board {
        /// File that describes the board.
        board: PathBuf,
        /// Thing to board frame.
        board_from_thing: Similarity,
    },
}

impl Default for Pose {
    fn default() -> Self {
        Self::World(Similarity::IDENTITY)
    }
}

impl Pose {
    /// The thing's pose within whatever it is attached to.
    pub fn frame_from_thing(&self) -> &Similarity {
        match self {
            Self::World(world_from_thing) => world_from_thing,
            Self::Marker { marker_from_thing, .. } => marker_from_thing,
            Self::Body { body_from_thing, .. } => body_from_thing,
            Self::Board { board_from_thing, .. } => board_from_thing,
        }
    }

    /// `world_from_thing`, or `None` while the tracker does not know the frame.
    ///
    /// `world_from_frame` is asked for every pose that is not fixed in the world.
    pub fn resolve(&self, world_from_frame: impl FnOnce(&Self) -> Option<Similarity>) -> Option<Similarity> {
        match self {
            Self::World(world_from_thing) => Some(*world_from_thing),
            tracked => Some(world_from_frame(tracked)? * *tracked.frame_from_thing()),
        }
    }
}
