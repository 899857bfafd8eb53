//! Tangents for meshes that have none.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};

use crate::mesh::{Mesh, MeshError};

/// Fills in tangents where they are missing (zero).
///
/// Like MikkTSpace: the gradient of u in each triangle, made perpendicular to the corner's normal, averaged over the
/// triangles around a corner with their angles as weights, apart for mirrored and unmirrored ones (a corner of both is
/// doubled). Unlike it, corners meet by their index, not by equal attributes, so across seams that an exporter has
/// split without need results differ slightly from baked maps. Without usable texture coordinates the tangent is any
/// one perpendicular to the normal.
///
/// # Errors
/// [`MeshError`] if attributes or indices do not fit together; the mesh is then left as it is.
pub fn complete(mesh: &mut Mesh) -> Result<(), MeshError> {
    mesh.check()?;
    mesh.tangents.resize(mesh.positions.len(), Vec4::ZERO);
    if mesh.normals.len() != mesh.positions.len() || mesh.uvs.len() != mesh.positions.len() {
        fill_arbitrary(mesh);
        return Ok(());
    }
    let given: Vec<bool> = mesh.tangents.iter().map(|tangent| *tangent != Vec4::ZERO).collect();
    let sums = accumulate(mesh, &given);
    // The first sign seen keeps the corner, the other one gets a copy.
    let mut keeps: HashMap<u32, bool> = HashMap::new();
    let mut copies: HashMap<u32, u32> = HashMap::new();
    for at in 0..mesh.indices.len() {
        let corner = mesh.indices[at];
        if given[corner as usize] {
            continue;
        }
        let mirrored = is_mirrored(mesh, at / 3);
        let target = if *keeps.entry(corner).or_insert(mirrored) == mirrored {
            corner
        } else {
            *copies.entry(corner).or_insert_with(|| duplicate(mesh, corner))
        };
        let sum = sums.get(&(corner, mirrored)).copied().unwrap_or(Vec3::ZERO);
        mesh.tangents[target as usize] = tangent(mesh.normals[corner as usize], sum, mirrored);
        mesh.indices[at] = target;
    }
    fill_arbitrary(mesh);
    Ok(())
}

fn accumulate(mesh: &Mesh, given: &[bool]) -> HashMap<(u32, bool), Vec3> {
    let mut sums: HashMap<(u32, bool), Vec3> = HashMap::new();
    for (triangle, corners) in mesh.triangles().enumerate() {
        let Some(gradient) = gradient_of_u(mesh, corners) else { continue };
        let mirrored = is_mirrored(mesh, triangle);
        for i in 0..3 {
            let [corner, next, previous] = [corners[i], corners[(i + 1) % 3], corners[(i + 2) % 3]];
            if given[corner as usize] {
                continue;
            }
            let at = |corner: u32| mesh.positions[corner as usize];
            let (to_next, to_previous) = (at(next) - at(corner), at(previous) - at(corner));
            let angle =
                to_next.normalize_or_zero().dot(to_previous.normalize_or_zero()).clamp(-1.0, 1.0).acos();
            let flat = gradient.reject_from_normalized(mesh.normals[corner as usize]).normalize_or_zero();
            *sums.entry((corner, mirrored)).or_insert(Vec3::ZERO) += flat * angle;
        }
    }
    sums
}

fn uv_corners(mesh: &Mesh, corners: [u32; 3]) -> [Vec2; 3] {
    corners.map(|corner| mesh.uvs[corner as usize])
}

/// v runs down, so an unmirrored triangle turns clockwise in (u, v).
fn is_mirrored(mesh: &Mesh, triangle: usize) -> bool {
    mesh.triangle(triangle).is_some_and(|corners| {
        let [a, b, c] = uv_corners(mesh, corners);
        (b - a).perp_dot(c - a) > 0.0
    })
}

/// Direction in which u grows, of unit length; `None` where u and v do not span the triangle.
fn gradient_of_u(mesh: &Mesh, corners: [u32; 3]) -> Option<Vec3> {
    let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
    let [ua, ub, uc] = uv_corners(mesh, corners);
    let (d1, d2) = (ub - ua, uc - ua);
    let determinant = d1.perp_dot(d2);
    ((b - a) * d2.y - (c - a) * d1.y)
        .try_normalize()
        .filter(|_| determinant != 0.0)
        .map(|t| t * determinant.signum())
}

/// glTF's bitangent `w · (n × t)` points towards −v, the picture's top.
fn tangent(normal: Vec3, sum: Vec3, mirrored: bool) -> Vec4 {
    let along = sum.reject_from_normalized(normal).normalize_or_zero();
    if along == Vec3::ZERO {
        return Vec4::ZERO;
    }
    along.extend(if mirrored { -1.0 } else { 1.0 })
}

fn duplicate(mesh: &mut Mesh, corner: u32) -> u32 {
    let from = corner as usize;
    mesh.positions.push(mesh.positions[from]);
    mesh.normals.push(mesh.normals[from]);
    mesh.uvs.push(mesh.uvs[from]);
    mesh.tangents.push(Vec4::ZERO);
    if !mesh.colors.is_empty() {
        mesh.colors.push(mesh.colors[from]);
    }
    mesh.positions.len() as u32 - 1
}

fn fill_arbitrary(mesh: &mut Mesh) {
    for (tangent, normal) in mesh.tangents.iter_mut().zip(&mesh.normals) {
        if *tangent == Vec4::ZERO && normal.is_normalized() {
            *tangent = normal.any_orthonormal_vector().extend(1.0);
        }
    }
}
