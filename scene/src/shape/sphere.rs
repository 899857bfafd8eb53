//! A ball.

use glam::{DVec3, Vec2};

use super::builder::{Builder, Vertex, cos_sin_of_turn};
use super::{MAX_SEGMENTS, ShapeError, check_segments, check_size};
use crate::mesh::Mesh;

/// A ball around the origin: `segments` meridians and `segments/2` bands of latitude, poles at ±z. Vertices lie on the
/// ball, normals are those of the ball; u runs eastward from +x, v from the north pole (0) to the south pole (1).
///
/// # Errors
/// [`ShapeError`] for a radius that is not positive and finite, or for segments that are odd, below 4 or above
/// [`MAX_SEGMENTS`].
pub fn sphere(radius_m: f32, segments: u32) -> Result<Mesh, ShapeError> {
    check_size("sphere", "radius_m", radius_m)?;
    check_segments("sphere", segments, 4, MAX_SEGMENTS)?;
    if !segments.is_multiple_of(2) {
        let expected = "an even number".to_owned();
        return Err(ShapeError::Segments { shape: "sphere", value: segments, expected });
    }
    let bands = segments / 2;
    let mut builder = Builder::default();
    builder.grid(segments, bands, |column, row| {
        let (cos_longitude, sin_longitude) = cos_sin_of_turn(column, segments);
        let (minus_sin_latitude, cos_latitude) = cos_sin_of_turn(row, segments);
        let direction =
            DVec3::new(cos_latitude * cos_longitude, cos_latitude * sin_longitude, -minus_sin_latitude);
        let uv = Vec2::new(column as f32 / segments as f32, 1.0 - row as f32 / bands as f32);
        let position = (direction * f64::from(radius_m)).as_vec3();
        Vertex { position, normal: direction.as_vec3(), uv }
    });
    Ok(builder.finish("sphere"))
}
