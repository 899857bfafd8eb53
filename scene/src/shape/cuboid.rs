//! A box.

use glam::{Vec2, Vec3};

use super::builder::{Builder, Vertex};
use super::{ShapeError, check_size};
use crate::mesh::Mesh;

/// A box around the origin with the given lengths of edges, metres. Each side shows the whole picture, upright on the
/// four walls; top and bottom have the picture's right at +x.
///
/// # Errors
/// [`ShapeError::Size`] for a length that is not positive and finite.
pub fn cuboid(size_m: Vec3) -> Result<Mesh, ShapeError> {
    check_size("box", "size_m.x", size_m.x)?;
    check_size("box", "size_m.y", size_m.y)?;
    check_size("box", "size_m.z", size_m.z)?;
    // Right and up of the picture on each side; right × up is the outward normal.
    let sides = [
        (Vec3::X, Vec3::Z),
        (Vec3::Y, Vec3::Z),
        (Vec3::NEG_X, Vec3::Z),
        (Vec3::NEG_Y, Vec3::Z),
        (Vec3::X, Vec3::Y),
        (Vec3::X, Vec3::NEG_Y),
    ];
    let mut builder = Builder::default();
    for (right, up) in sides {
        let normal = right.cross(up);
        builder.grid(1, 1, |column, row| {
            let (u, up_share) = (column as f32, row as f32);
            let unit = right * (u - 0.5) + up * (up_share - 0.5) + normal * 0.5;
            Vertex { position: unit * size_m, normal, uv: Vec2::new(u, 1.0 - up_share) }
        });
    }
    Ok(builder.finish("box"))
}
