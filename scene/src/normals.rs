//! Normals for meshes that have none.

use glam::Vec3;

/// Unit normals at the corners of an indexed mesh: the mean of the triangles around, weighted by area. Corners of
/// degenerate triangles only get +Z.
///
/// Indices must be in range.
pub fn smooth(positions: &[Vec3], indices: &[u32]) -> Vec<Vec3> {
    let mut sums = vec![glam::DVec3::ZERO; positions.len()];
    for corners in indices.chunks_exact(3) {
        let [a, b, c] =
            [corners[0], corners[1], corners[2]].map(|corner| positions[corner as usize].as_dvec3());
        // Twice the area long, so that the sum is weighted.
        let facing = (b - a).cross(c - a);
        if facing.is_finite() {
            corners.iter().for_each(|&corner| sums[corner as usize] += facing);
        }
    }
    sums.into_iter().map(|sum| sum.normalize_or(glam::DVec3::Z).as_vec3()).collect()
}

/// Unit normal of a triangle by its winding; +Z for a degenerate one.
pub fn flat(a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
    (b - a).cross(c - a).normalize_or(glam::DVec3::Z).as_vec3()
}

/// Replaces normals that are not of unit length by those of [`smooth`], and says how many.
///
/// Indices must be in range, and there must be a normal for each position.
pub fn repair(normals: &mut [Vec3], positions: &[Vec3], indices: &[u32]) -> usize {
    let broken = normals.iter().filter(|normal| !normal.is_normalized()).count();
    if broken > 0 {
        let replacements = smooth(positions, indices);
        let pairs = normals.iter_mut().zip(replacements);
        pairs.filter(|(normal, _)| !normal.is_normalized()).for_each(|(normal, smooth)| *normal = smooth);
    }
    broken
}
