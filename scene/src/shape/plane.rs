//! A rectangle.

use glam::{Vec2, Vec3};

use super::builder::{Builder, Vertex};
use super::{ShapeError, check_size};
use crate::mesh::Mesh;

/// A rectangle around the origin in z = 0 that faces +z, lengths along x and y in metres. The picture's right is +x,
/// its top +y. The only open shape: seen from below it is a back face.
///
/// # Errors
/// [`ShapeError::Size`] for a length that is not positive and finite.
pub fn plane(size_m: Vec2) -> Result<Mesh, ShapeError> {
    check_size("plane", "size_m.x", size_m.x)?;
    check_size("plane", "size_m.y", size_m.y)?;
    let mut builder = Builder::default();
    builder.grid(1, 1, |column, row| {
        let (x, y) = (column as f32, row as f32);
        let position = Vec3::new((x - 0.5) * size_m.x, (y - 0.5) * size_m.y, 0.0);
        Vertex { position, normal: Vec3::Z, uv: Vec2::new(x, 1.0 - y) }
    });
    Ok(builder.finish("plane"))
}
