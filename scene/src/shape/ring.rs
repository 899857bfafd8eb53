//! A finger ring.

use glam::{DVec2, DVec3, Vec2};

use super::builder::{Builder, Vertex, cos_sin_of_turn};
use super::{MAX_SEGMENTS, ShapeError, check_segments, check_size};
use crate::mesh::Mesh;

/// Segments of each rounded corner of the profile.
const BEVEL_SEGMENTS: u32 = 12;

/// Measures of a [`ring`], metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingSize {
    /// Of the hole.
    pub inner_radius_m: f32,
    /// Of the outside.
    pub outer_radius_m: f32,
    /// Along the axis.
    pub height_m: f32,
    /// Radius of the rounded edges: 0 for sharp ones, at most half the wall and half the height.
    pub bevel_m: f32,
}

/// A finger ring around the z axis, centred on the origin: a rectangle with rounded corners turned around the axis.
///
/// Lying in the light its inner wall casts the heart-shaped caustic the ring is famous for. With the height equal to
/// the wall and the bevel half of it the profile is a circle and the ring a torus. u runs around the axis, v along
/// the profile from the middle of the bottom's outer corner down: inside, top, outside.
///
/// # Errors
/// [`ShapeError`] names the measure that is not positive and finite, a hole not smaller than the outside, a bevel too
/// large, or segments below 3 or above [`MAX_SEGMENTS`].
pub fn ring(size: RingSize, segments: u32) -> Result<Mesh, ShapeError> {
    check(&size, segments)?;
    let pieces = profile(&size);
    let length: f64 = pieces.iter().map(Piece::length).sum();
    let mut builder = Builder::default();
    let mut done = 0.0;
    for piece in &pieces {
        let rows = piece.rows();
        builder.grid(segments, rows, |column, row| {
            let (cos, sin) = cos_sin_of_turn(column, segments);
            let (point, normal) = piece.at(row);
            let turned = |p: DVec2| DVec3::new(p.x * cos, p.x * sin, p.y).as_vec3();
            let along = (done + piece.length() * f64::from(row) / f64::from(rows)) / length;
            let uv = Vec2::new(column as f32 / segments as f32, 1.0 - along as f32);
            Vertex { position: turned(point), normal: turned(normal), uv }
        });
        done += piece.length();
    }
    Ok(builder.finish("ring"))
}

fn check(size: &RingSize, segments: u32) -> Result<(), ShapeError> {
    check_size("ring", "inner_radius_m", size.inner_radius_m)?;
    check_size("ring", "outer_radius_m", size.outer_radius_m)?;
    check_size("ring", "height_m", size.height_m)?;
    check_segments("ring", segments, 3, MAX_SEGMENTS)?;
    let wrong = |field, value, expected| Err(ShapeError::Size { shape: "ring", field, value, expected });
    let wall_m = size.outer_radius_m - size.inner_radius_m;
    if wall_m < 1e-6 * size.outer_radius_m {
        let expected = format!("more than inner_radius_m = {}", size.inner_radius_m);
        return wrong("outer_radius_m", size.outer_radius_m, expected);
    }
    // One part in 10⁵ above the limit is rounding: (0.011 − 0.009)/2 in f32 is not 0.001.
    let most = wall_m.min(size.height_m) / 2.0;
    if !(0.0..=most * 1.00001).contains(&size.bevel_m) {
        return wrong("bevel_m", size.bevel_m, format!("0 to {most}, half the wall and half the height"));
    }
    Ok(())
}

/// A part of the profile in (distance from the axis, z).
enum Piece {
    Wall { ends: [DVec2; 2], normal: DVec2 },
    Corner { center: DVec2, radius: f64, quarter: u32 },
}

impl Piece {
    fn rows(&self) -> u32 {
        match self {
            Self::Wall { .. } => 1,
            Self::Corner { .. } => BEVEL_SEGMENTS,
        }
    }

    fn length(&self) -> f64 {
        match self {
            Self::Wall { ends: [start, end], .. } => start.distance(*end),
            Self::Corner { radius, .. } => radius * std::f64::consts::FRAC_PI_2,
        }
    }

    fn at(&self, row: u32) -> (DVec2, DVec2) {
        match self {
            Self::Wall { ends: [start, end], normal } => (if row == 0 { *start } else { *end }, *normal),
            Self::Corner { center, radius, quarter } => {
                let normal = quarter_turn(*quarter, row);
                (*center + *radius * normal, normal)
            }
        }
    }
}

/// Direction `row` steps into the given quarter.
fn quarter_turn(quarter: u32, row: u32) -> DVec2 {
    let (cos, sin) = cos_sin_of_turn(quarter * BEVEL_SEGMENTS + row, 4 * BEVEL_SEGMENTS);
    DVec2::new(cos, sin)
}

/// Counter-clockwise in (distance, z), from the outer wall on; pieces without length are left out.
fn profile(size: &RingSize) -> Vec<Piece> {
    let [inner, outer] = [f64::from(size.inner_radius_m), f64::from(size.outer_radius_m)];
    let middle = DVec2::new((inner + outer) / 2.0, 0.0);
    let half = DVec2::new((outer - inner) / 2.0, f64::from(size.height_m) / 2.0);
    let radius = f64::from(size.bevel_m).min(half.min_element());
    // A wall that rounding leaves between two corners would be a sliver: the corners meet instead.
    let inset = (half - radius).map(|rest| if rest < 1e-5 * half.min_element() { 0.0 } else { rest });
    let signs = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let centers = signs.map(|(x, y)| middle + inset * DVec2::new(x, y));
    let mut pieces = Vec::with_capacity(8);
    for quarter in 0..4_u32 {
        let center = centers[quarter as usize];
        let previous = centers[(quarter as usize + 3) % 4];
        let normal = quarter_turn(quarter, 0);
        let ends = [previous + radius * normal, center + radius * normal];
        if ends[0] != ends[1] {
            pieces.push(Piece::Wall { ends, normal });
        }
        if radius > 0.0 {
            pieces.push(Piece::Corner { center, radius, quarter });
        }
    }
    pieces
}
