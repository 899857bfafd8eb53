//! Where rays that leave a surface start: off the surface by a little more than rounding can move either end.
//!
//! In the spirit of C. Wächter and N. Binder, *A Fast and Robust Method for Avoiding Self-Intersection* (Ray Tracing
//! Gems, 2019, ch. 6), but with a distance that follows from the arithmetic. The watertight test computes the height of
//! the origin over a triangle's plane with an error of a few ulps of the largest number involved: the coordinates of the
//! point (they are subtracted) and the extent of the triangle (its corners are weighted). An offset of 32 ulps of
//! both keeps an origin on its own side of its own triangle and of its neighbours in the same plane.
//!
//! In a concave edge the same rounding could put the point behind the neighbouring wall. So points are also kept away
//! from the edges of their triangle, by four such offsets, which is enough for wedges down to about 28°.

use glam::Vec3;

/// In ulps of the largest coordinate.
const SAFETY: f32 = 32.0;
/// In offsets.
const EDGE_SAFETY: f32 = 4.0;

/// Distance from the surface at which rays start, metres.
pub fn offset_m(position: Vec3, corners: &[Vec3; 3]) -> f32 {
    let [a, b, c] = *corners;
    let extent = (b - a).abs().max((c - a).abs()).max_element();
    let size = position.abs().max_element().max(extent);
    SAFETY * f32::EPSILON * size
}

/// The barycentric coordinates moved into the triangle, until they are at least four offsets away from each edge (or in
/// the middle, where the triangle is too thin for that).
pub fn away_from_edges(barycentric: Vec3, corners: &[Vec3; 3]) -> Vec3 {
    let [a, b, c] = *corners;
    let position = a * barycentric.x + b * barycentric.y + c * barycentric.z;
    let margin_m = EDGE_SAFETY * offset_m(position, corners);
    let twice_area = (b - a).cross(c - a).length();
    let opposite_edge = Vec3::new(b.distance(c), c.distance(a), a.distance(b));
    // Barycentric coordinate i is the distance from edge i over the height on it.
    let least = (opposite_edge * (margin_m / twice_area)).min(Vec3::splat(1.0 / 3.0));
    if !least.is_finite() || barycentric.cmpge(least).all() {
        return barycentric;
    }
    let lifted = barycentric.max(least);
    lifted / lifted.element_sum()
}
