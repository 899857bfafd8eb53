//! Normals.
//!
//! A shading normal may turn so far from the triangle that the viewer would see it from behind, or that a mirror would
//! send light into the surface. It is then bent back towards the geometric normal, by the least turn that lets both the
//! viewer and its mirror image be on the right side. This concerns grazing views only.

use glam::{Vec3, Vec4};

use super::texture;
use crate::accel::Geometry;
use crate::bsdf::Frame;
use crate::bsdf::fresnel::reflect;

/// Least cosine of the viewer and of its mirror image with the geometric surface.
const GRAZING: f32 = 1e-4;

/// Unit normal of a triangle, on the side from which its corners run counter-clockwise.
pub fn geometric([a, b, c]: &[Vec3; 3]) -> Vec3 {
    // In f64: slivers cancel.
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    (b - a).cross(c - a).normalize_or(glam::DVec3::Z).as_vec3()
}

/// The frame around the shading normal, on the side of the geometric normal; x along the texture's u where there are
/// texture coordinates.
pub fn shading_frame(
    geometry: &Geometry,
    triangle: u32,
    barycentric: Vec3,
    geometric_normal: Vec3,
    to_viewer: Vec3,
) -> Frame {
    let interpolated = interpolated_normal(geometry, triangle, barycentric, geometric_normal);
    let tangent = tangent(geometry, triangle, barycentric, interpolated);
    let mapped = mapped_normal(geometry, triangle, barycentric, interpolated, tangent);
    let normal = keep_above(mapped, geometric_normal, to_viewer);
    Frame::with_tangent(normal, tangent.truncate())
}

fn interpolated_normal(
    geometry: &Geometry,
    triangle: u32,
    barycentric: Vec3,
    geometric_normal: Vec3,
) -> Vec3 {
    let thing = geometry.thing_of(triangle);
    let Some(normal) = geometry.interpolate(triangle, barycentric, &thing.mesh.normals) else {
        return geometric_normal;
    };
    let normal = thing.world_from_thing.transform_direction(normal).normalize_or(geometric_normal);
    // Normals that contradict the winding say nothing about the side; the winding does.
    if normal.dot(geometric_normal) < 0.0 { -normal } else { normal }
}

/// Direction of +u and, in w, the sign of the bitangent `w · (n × t)`.
fn tangent(geometry: &Geometry, triangle: u32, barycentric: Vec3, normal: Vec3) -> Vec4 {
    let thing = geometry.thing_of(triangle);
    if let Some(tangent) = geometry.interpolate(triangle, barycentric, &thing.mesh.tangents) {
        let world = thing.world_from_thing.transform_direction(tangent.truncate());
        return world.extend(1.0_f32.copysign(tangent.w));
    }
    uv_tangent(geometry, triangle, normal).unwrap_or_else(|| Frame::around(normal).tangent.extend(1.0))
}

/// From the derivatives of the texture coordinates over the triangle.
fn uv_tangent(geometry: &Geometry, triangle: u32, normal: Vec3) -> Option<Vec4> {
    if geometry.thing_of(triangle).mesh.uvs.is_empty() {
        return None;
    }
    let [a, b, c] = geometry.corners(triangle);
    let [uv_a, uv_b, uv_c] = [Vec3::X, Vec3::Y, Vec3::Z].map(|corner| geometry.uv(triangle, corner));
    let (edge_b, edge_c, uv_b, uv_c) = (b - a, c - a, uv_b - uv_a, uv_c - uv_a);
    let determinant = uv_b.perp_dot(uv_c);
    let along_u = (edge_b * uv_c.y - edge_c * uv_b.y) * determinant.signum();
    let along_v = (edge_c * uv_b.x - edge_b * uv_c.x) * determinant.signum();
    // glTF: v runs down in the picture, but a normal map's green points up it; the bitangent is against +v.
    let sign = 1.0_f32.copysign(normal.cross(along_u).dot(-along_v));
    Some(along_u.try_normalize()?.extend(sign))
}

fn mapped_normal(geometry: &Geometry, triangle: u32, barycentric: Vec3, normal: Vec3, tangent: Vec4) -> Vec3 {
    let Some(map) = &geometry.material(triangle).normal_map else {
        return normal;
    };
    let texel = texture::lookup(&map.texture, geometry.uv(triangle, barycentric)).truncate();
    let local = (texel * 2.0 - 1.0) * Vec3::new(map.scale, map.scale, 1.0);
    let frame = Frame::with_tangent(normal, tangent.truncate());
    let bitangent = frame.bitangent * tangent.w;
    (frame.tangent * local.x + bitangent * local.y + normal * local.z).normalize_or(normal)
}

/// Bends a shading normal towards the geometric one until the viewer and its mirror image are above both.
fn keep_above(shading: Vec3, geometric: Vec3, to_viewer: Vec3) -> Vec3 {
    let side = 1.0_f32.copysign(to_viewer.dot(geometric));
    let (viewer, least) = (to_viewer * side, GRAZING.min(to_viewer.dot(geometric).abs() / 2.0));
    let fits = |normal: Vec3| {
        let mirrored = reflect(viewer, normal);
        viewer.dot(normal) >= least && mirrored.dot(geometric) >= least && normal.dot(geometric) > 0.0
    };
    if fits(shading) {
        return shading;
    }
    let bent = |share: f32| shading.lerp(geometric, share).normalize_or(geometric);
    let (mut too_little, mut enough) = (0.0_f32, 1.0_f32);
    for _ in 0..12 {
        let middle = too_little.midpoint(enough);
        if fits(bent(middle)) { enough = middle } else { too_little = middle }
    }
    bent(enough)
}
