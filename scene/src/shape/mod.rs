//! Shapes that need no file.
//!
//! All stand in their own frame with +Z up, wind counter-clockwise seen from outside, have unit normals, texture
//! coordinates that show a picture upright and unmirrored, and one material slot. All but the plane are closed.

mod builder;
mod cuboid;
mod plane;
mod ring;
mod sphere;
mod teapot;

use glam::{Vec2, Vec3};
use thiserror::Error;

use crate::mesh::Mesh;

pub use cuboid::cuboid;
pub use plane::plane;
pub use ring::{RingSize, ring};
pub use sphere::sphere;
pub use teapot::{TeapotLid, teapot};

/// Segments around, unless the session says otherwise.
pub const DEFAULT_SEGMENTS: u32 = 64;
/// Most segments a shape takes (a sphere then has 4 million triangles).
pub const MAX_SEGMENTS: u32 = 2048;

/// A shape and its measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// See [`cuboid`].
    Box {
        /// Lengths of the edges.
        size_m: Vec3,
    },
    /// See [`sphere`].
    Sphere {
        /// Of the circumscribed ball.
        radius_m: f32,
        /// Around the equator, even.
        segments: u32,
    },
    /// See [`plane`].
    Plane {
        /// Along x and y.
        size_m: Vec2,
    },
    /// See [`ring`].
    Ring {
        /// Radii, height and bevel.
        size: RingSize,
        /// Around the axis.
        segments: u32,
    },
    /// See [`teapot`].
    Teapot {
        /// From the table to the top of the knob.
        height_m: f32,
        /// Along each edge of the 32 patches.
        segments: u32,
    },
}

/// Why there is no such shape.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ShapeError {
    /// A measure makes no sense.
    #[error("{shape}: {field} = {value}, expected {expected}")]
    Size {
        /// Kind of shape.
        shape: &'static str,
        /// Name of the measure.
        field: &'static str,
        /// Its value.
        value: f32,
        /// What would be right.
        expected: String,
    },
    /// Too coarse or too fine.
    #[error("{shape}: segments = {value}, expected {expected}")]
    Segments {
        /// Kind of shape.
        shape: &'static str,
        /// The number given.
        value: u32,
        /// What would be right.
        expected: String,
    },
}

impl Shape {
    /// Its surface.
    ///
    /// # Errors
    /// [`ShapeError`] names the measure that is not positive and finite, or out of range.
    pub fn mesh(&self) -> Result<Mesh, ShapeError> {
        match *self {
            Self::Box { size_m } => cuboid(size_m),
            Self::Sphere { radius_m, segments } => sphere(radius_m, segments),
            Self::Plane { size_m } => plane(size_m),
            Self::Ring { size, segments } => ring(size, segments),
            Self::Teapot { height_m, segments } => teapot(height_m, segments, TeapotLid::Sealed),
        }
    }
}

/// Sizes below 1 nm or above 1000 km are mistakes, and would leave the range in which f32 squares are exact enough.
fn check_size(shape: &'static str, field: &'static str, value: f32) -> Result<(), ShapeError> {
    if value.is_finite() && (1e-9..=1e6).contains(&value) {
        return Ok(());
    }
    Err(ShapeError::Size { shape, field, value, expected: "a length from 1e-9 to 1e6 metres".to_owned() })
}

fn check_segments(shape: &'static str, value: u32, least: u32, most: u32) -> Result<(), ShapeError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(ShapeError::Segments { shape, value, expected: format!("{least} to {most}") })
}

#[cfg(test)]
mod tests;
