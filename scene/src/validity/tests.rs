//! Each problem made on purpose, and none found where there is none.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use super::*;
use crate::mesh::Part;
use crate::pose::{Pose, Similarity};
use crate::shape::{RingSize, TeapotLid, cuboid, plane, ring, sphere, teapot};
use crate::world::World;

fn problems(mesh: &Mesh, material: &Material) -> Vec<(Problem, usize)> {
    check_mesh(mesh, &[material], 1.0).iter().map(|finding| (finding.problem, finding.count)).collect()
}

#[test]
fn sound_shapes_have_no_findings() {
    let size = RingSize { inner_radius_m: 0.009, outer_radius_m: 0.011, height_m: 0.004, bevel_m: 0.0005 };
    let shapes = [
        cuboid(Vec3::ONE).unwrap(),
        sphere(0.1, 64).unwrap(),
        ring(size, 64).unwrap(),
        teapot(0.15, 16, TeapotLid::Sealed).unwrap(),
    ];
    for mesh in shapes {
        assert_eq!(problems(&mesh, &Material::glass(1.5)), [], "{}", mesh.name);
    }
    assert_eq!(problems(&plane(Vec2::ONE).unwrap(), &Material::default()), []);
}

#[test]
fn refractors_must_be_closed() {
    let pane = plane(Vec2::ONE).unwrap();
    assert_eq!(problems(&pane, &Material::glass(1.5)), [(Problem::Open, 4)]);
    let thin = Material { thickness_m: 0.0, ..Material::glass(1.5) };
    assert_eq!(check_mesh(&pane, &[&thin], 1.0)[0].severity, Severity::Note);
    let open = teapot(0.15, 8, TeapotLid::Open).unwrap();
    assert_eq!(problems(&open, &Material::glass(1.5)), [(Problem::Open, 8 * 16)]);
    let text = check_mesh(&pane, &[&Material::glass(1.5)], 1.0)[0].to_string();
    assert!(text.contains("4 edges of one triangle only") && text.contains("for example at ("), "{text}");
}

#[test]
fn opaque_parts_may_close_a_refractor() {
    let mut mesh = cuboid(Vec3::ONE).unwrap();
    mesh.parts = vec![Part { triangles: 0..10, material: 0 }, Part { triangles: 10..12, material: 1 }];
    assert_eq!(check_mesh(&mesh, &[&Material::glass(1.5), &Material::default()], 1.0), []);
}

#[test]
fn refractors_must_face_outward() {
    let mut mesh = sphere(0.1, 16).unwrap();
    mesh.indices.chunks_exact_mut(3).for_each(|corners| corners.swap(1, 2));
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    let triangles = mesh.triangle_count();
    let found = problems(&mesh, &Material::glass(1.5));
    assert_eq!(found, [(Problem::Inward, 1), (Problem::MirroredUv, triangles)]);
    // One face turned around: its three edges disagree with their neighbours, its normals with its winding.
    let mut mesh = sphere(0.1, 16).unwrap();
    mesh.indices.swap(301, 302);
    let found = problems(&mesh, &Material::glass(1.5));
    assert!(
        found.contains(&(Problem::Flipped, 3)) && found.contains(&(Problem::NormalsAgainstWinding, 1)),
        "{found:?}"
    );
}

/// A hollow ball: the inner wall winds inward and should. The same ball beside the outer one should not.
#[test]
fn cavities_are_no_mistake() {
    let with_inner_at = |x: f32| {
        let mut mesh = sphere(0.1, 16).unwrap();
        let inner = sphere(0.05, 16).unwrap();
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(inner.positions.iter().map(|point| *point + Vec3::X * x));
        mesh.normals.extend(inner.normals.iter().map(|normal| -*normal));
        mesh.uvs.extend(&inner.uvs);
        mesh.indices
            .extend(inner.indices.chunks_exact(3).flat_map(|c| [c[0] + first, c[2] + first, c[1] + first]));
        mesh.parts[0].triangles = 0..mesh.triangle_count() as u32;
        problems(&mesh, &Material::glass(1.5)).iter().any(|(problem, _)| *problem == Problem::Inward)
    };
    assert!(!with_inner_at(0.0));
    assert!(with_inner_at(1.0));
}

#[test]
fn fins_are_not_manifold() {
    let mut mesh = cuboid(Vec3::ONE).unwrap();
    let first = mesh.positions.len() as u32;
    // A triangle standing on one edge of the box.
    mesh.positions.extend([Vec3::new(-0.5, -0.5, 0.5), Vec3::new(0.5, -0.5, 0.5), Vec3::new(0.0, -0.5, 1.0)]);
    mesh.normals.extend([Vec3::NEG_Y; 3]);
    mesh.uvs.extend([Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(0.5, 0.0)]);
    mesh.indices.extend([first, first + 1, first + 2]);
    mesh.parts[0].triangles = 0..13;
    assert_eq!(problems(&mesh, &Material::glass(1.5)), [(Problem::Open, 2), (Problem::NonManifold, 1)]);
    assert_eq!(problems(&mesh, &Material::default()), []);
}

#[test]
fn broken_numbers_are_found() {
    let mut mesh = sphere(1.0, 16).unwrap();
    mesh.positions[20] = Vec3::new(f32::NAN, 0.0, 0.0);
    mesh.positions[40].y = f32::INFINITY;
    mesh.normals[60] *= 0.5;
    mesh.normals[80].x = f32::NAN;
    let found = problems(&mesh, &Material::default());
    assert!(
        found.contains(&(Problem::NotFinite, 2)) && found.contains(&(Problem::NotUnitNormals, 2)),
        "{found:?}"
    );
    let mut mesh = plane(Vec2::ONE).unwrap();
    // Onto the diagonal: of the two triangles only the other one keeps an area.
    mesh.positions[2] = mesh.positions[0].midpoint(mesh.positions[3]);
    assert!(problems(&mesh, &Material::default()).iter().any(|(problem, _)| *problem == Problem::Degenerate));
}

#[test]
fn broken_structure_is_found() {
    let mut mesh = plane(Vec2::ONE).unwrap();
    assert_eq!(check_mesh(&mesh, &[], 1.0)[0].problem, Problem::MissingMaterial);
    mesh.indices[4] = 4;
    let findings = check_mesh(&mesh, &[&Material::default()], 1.0);
    assert_eq!((findings.len(), findings[0].problem), (1, Problem::Structure));
    assert!(findings[0].text.contains("index 4 of triangle 1"), "{}", findings[0].text);
    assert_eq!(problems(&Mesh::default(), &Material::default()), [(Problem::Empty, 0)]);
}

#[test]
fn sizes_hint_at_units() {
    let mesh = cuboid(Vec3::splat(0.2)).unwrap();
    let at =
        |scale: f32| check_mesh(&mesh, &[&Material::default()], scale).first().map(|finding| finding.problem);
    assert_eq!(at(1.0), None);
    assert_eq!(at(1000.0), Some(Problem::Huge));
    assert_eq!(at(1e-4), Some(Problem::Tiny));
    let thing = Thing {
        name: "box".to_owned(),
        world: World::Virtual,
        mesh: Arc::new(mesh),
        materials: vec![Arc::new(Material { base_color: Vec4::ONE, ..Material::default() })],
        pose: Pose::World(Similarity::from_scale(1000.0)),
        hide_marker: false,
    };
    let finding = &check_thing(&thing)[0];
    assert!(finding.text.contains("200 m") && finding.text.contains("scale = 0.001"), "{finding}");
}
