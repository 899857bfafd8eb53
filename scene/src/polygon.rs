//! Polygons into triangles.

use glam::{Vec2, Vec3};

/// Above so many corners a polygon is taken for convex, so that a hostile file cannot make cutting ears take for ever.
const MAX_EARS: usize = 256;

/// Triangles of a polygon as positions in `outline`, wound as the polygon. Concave ones are cut ear by ear in the plane
/// of their mean normal; convex ones, and those that are no simple polygon, become a fan. `n − 2` triangles always.
pub fn triangulate(outline: &[Vec3]) -> Vec<[usize; 3]> {
    let count = outline.len();
    if count < 3 {
        return Vec::new();
    }
    let flat = projected(outline);
    if count == 3 || count > MAX_EARS || is_convex(&flat) {
        return fan(&(0..count).collect::<Vec<_>>());
    }
    let mut left: Vec<usize> = (0..count).collect();
    let mut triangles = Vec::with_capacity(count - 2);
    while left.len() > 3 {
        let Some(ear) = (0..left.len()).find(|&at| is_ear(&flat, &left, at)) else { break };
        triangles.push(neighbours(&left, ear));
        left.remove(ear);
    }
    triangles.extend(fan(&left));
    triangles
}

fn fan(corners: &[usize]) -> Vec<[usize; 3]> {
    corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]).collect()
}

/// Seen against the polygon's normal (Newell's method), so that it runs counter-clockwise.
fn projected(outline: &[Vec3]) -> Vec<Vec2> {
    let next = outline.iter().cycle().skip(1);
    let origin = outline.first().copied().unwrap_or_default();
    let doubled_area: Vec3 = outline.iter().zip(next).map(|(a, b)| (*a - origin).cross(*b - origin)).sum();
    let (right, up) = doubled_area.try_normalize().unwrap_or(Vec3::Z).any_orthonormal_pair();
    outline.iter().map(|point| Vec2::new(point.dot(right), point.dot(up))).collect()
}

fn turn(a: Vec2, b: Vec2, c: Vec2) -> f32 {
    (b - a).perp_dot(c - b)
}

fn is_convex(flat: &[Vec2]) -> bool {
    let count = flat.len();
    (0..count).all(|i| turn(flat[i], flat[(i + 1) % count], flat[(i + 2) % count]) >= 0.0)
}

fn neighbours(left: &[usize], at: usize) -> [usize; 3] {
    let count = left.len();
    [left[(at + count - 1) % count], left[at], left[(at + 1) % count]]
}

fn is_ear(flat: &[Vec2], left: &[usize], at: usize) -> bool {
    let corners = neighbours(left, at);
    let [a, b, c] = corners.map(|corner| flat[corner]);
    let inside = |p: Vec2| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    turn(a, b, c) > 0.0 && !left.iter().any(|corner| !corners.contains(corner) && inside(flat[*corner]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::triangle_area_m2;
    use crate::normals::flat;

    fn area(outline: &[Vec3]) -> f64 {
        triangulate(outline)
            .iter()
            .map(|corner| triangle_area_m2(outline[corner[0]], outline[corner[1]], outline[corner[2]]))
            .sum()
    }

    #[test]
    fn concave_polygons_keep_their_area_and_winding() {
        // An L of three unit squares, started at every corner, in a tilted plane; a fan from most corners would cover
        // more than 3.
        let ell = [(0., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 2.), (0., 2.)];
        let tilt = glam::Quat::from_rotation_x(0.7) * glam::Quat::from_rotation_y(-0.4);
        for start in 0..6 {
            let outline: Vec<Vec3> =
                (0..6).map(|i| ell[(i + start) % 6]).map(|(x, y)| tilt * Vec3::new(x, y, 0.0)).collect();
            assert!((area(&outline) - 3.0).abs() < 1e-5, "start {start}: {}", area(&outline));
            for [a, b, c] in triangulate(&outline) {
                assert!(flat(outline[a], outline[b], outline[c]).dot(tilt * Vec3::Z) > 0.999);
            }
        }
    }

    #[test]
    fn any_outline_gives_all_its_triangles() {
        let bow_tie = [Vec3::ZERO, Vec3::X + Vec3::Y, Vec3::X, Vec3::Y];
        assert_eq!(triangulate(&bow_tie).len(), 2);
        assert_eq!(triangulate(&[Vec3::NAN; 5]).len(), 3);
        assert_eq!(triangulate(&vec![Vec3::ZERO; 5000]).len(), 4998);
        assert!(triangulate(&[Vec3::ZERO; 2]).is_empty());
    }
}
