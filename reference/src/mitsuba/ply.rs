//! Triangles of one material as binary PLY, in world coordinates.

use coshade_scene::{Mesh, Similarity};
use glam::{Vec2, Vec3};

/// The triangles of a material slot; `None` if there are none. The mesh has passed [`Mesh::check`].
pub fn bytes(mesh: &Mesh, slot: usize, world_from_mesh: &Similarity) -> Option<Vec<u8>> {
    let parts = mesh.parts.iter().filter(|part| part.material == slot);
    let triangles = parts.flat_map(|part| part.triangles.clone());
    let corners: Vec<u32> =
        triangles.filter_map(|triangle| mesh.triangle(triangle as usize)).flatten().collect();
    if corners.is_empty() {
        return None;
    }
    let mut used = corners.clone();
    used.sort_unstable();
    used.dedup();
    let mut file = header(mesh, used.len(), corners.len() / 3).into_bytes();
    for &vertex in &used {
        push_vertex(&mut file, mesh, vertex as usize, world_from_mesh);
    }
    for triangle in corners.chunks_exact(3) {
        file.push(3);
        for corner in triangle {
            let at = used.partition_point(|vertex| vertex < corner) as u32;
            file.extend_from_slice(&at.to_le_bytes());
        }
    }
    Some(file)
}

fn header(mesh: &Mesh, vertices: usize, triangles: usize) -> String {
    let normals = if mesh.normals.is_empty() {
        ""
    } else {
        "property float nx\nproperty float ny\nproperty float nz\n"
    };
    let uvs = if mesh.uvs.is_empty() { "" } else { "property float u\nproperty float v\n" };
    format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n\
         property float x\nproperty float y\nproperty float z\n{normals}{uvs}\
         element face {triangles}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

fn push_vertex(file: &mut Vec<u8>, mesh: &Mesh, vertex: usize, world_from_mesh: &Similarity) {
    let mut push = |values: &[f32]| file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    let position = mesh.positions.get(vertex).copied().unwrap_or(Vec3::ZERO);
    push(&world_from_mesh.transform_point(position).to_array());
    if let Some(&normal) = mesh.normals.get(vertex) {
        push(&world_from_mesh.transform_direction(normal).to_array());
    }
    if let Some(&uv) = mesh.uvs.get(vertex) {
        push(&Vec2::to_array(&uv));
    }
}
