//! Areas and volumes against closed forms, closedness by Euler's characteristic, normals against winding.

use std::f64::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::*;
use crate::mesh::Mesh;
use crate::topology::Topology;

/// Vertices are f32: lengths are off by 2⁻²⁴, areas and volumes by a few times that.
const ROUNDING: f64 = 1e-6;

fn assert_close(found: f64, expected: f64, relative: f64, what: &str) {
    let error = ((found - expected) / expected).abs();
    assert!(
        error <= relative,
        "{what}: {found}, expected {expected} (relative error {error:.2e} > {relative:.0e})"
    );
}

/// Structure, unit normals on the side of the winding, uv in the unit square and unmirrored.
fn assert_sound(mesh: &Mesh) {
    mesh.check().unwrap();
    assert_eq!(mesh.material_slots(), 1);
    assert_eq!(mesh.normals.len(), mesh.positions.len());
    assert_eq!(mesh.uvs.len(), mesh.positions.len());
    for normal in &mesh.normals {
        assert!((normal.length() - 1.0).abs() < 1e-6, "{normal}");
    }
    for uv in &mesh.uvs {
        assert!(uv.cmpge(Vec2::splat(-1e-6)).all() && uv.cmple(Vec2::splat(1.0 + 1e-6)).all(), "{uv}");
    }
    for (triangle, [a, b, c]) in mesh.triangles().zip(mesh.triangle_positions()) {
        let facing = (b - a).cross(c - a);
        assert!(facing.length() > 0.0, "{}: degenerate {a} {b} {c}", mesh.name);
        for corner in triangle {
            let normal = mesh.normals[corner as usize];
            assert!(normal.dot(facing) > 0.0, "{}: {normal} against {facing} at {a} {b} {c}", mesh.name);
        }
        let [ua, ub, uc] = triangle.map(|corner| mesh.uvs[corner as usize]);
        // v runs down: an unmirrored picture turns clockwise in (u, v) where the triangle turns counter-clockwise.
        assert!((ub - ua).perp_dot(uc - ua) < 1e-7, "{}: mirrored uv {ua} {ub} {uc}", mesh.name);
    }
}

#[test]
fn box_is_exact() {
    let size = Vec3::new(1.2, 0.8, 0.03);
    let mesh = cuboid(size).unwrap();
    assert_sound(&mesh);
    let [x, y, z] = size.as_dvec3().to_array();
    assert_close(mesh.area_m2(), 2.0 * (x * y + y * z + z * x), ROUNDING, "area");
    assert_close(mesh.volume_m3(), x * y * z, ROUNDING, "volume");
    let topology = Topology::of(&mesh);
    assert!(topology.is_closed());
    assert_eq!((topology.vertices, topology.edges, topology.faces), (8, 18, 12));
    let aabb = mesh.aabb().unwrap();
    assert_eq!((aabb.min, aabb.max), (-size / 2.0, size / 2.0));
}

#[test]
fn plane_faces_up_and_is_open() {
    let mesh = plane(Vec2::new(2.0, 3.0)).unwrap();
    assert_sound(&mesh);
    assert_eq!(mesh.area_m2(), 6.0);
    assert!(mesh.normals.iter().all(|&normal| normal == Vec3::Z));
    let topology = Topology::of(&mesh);
    assert_eq!(topology.open_edges.len(), 4);
    assert_eq!(topology.euler_characteristic(), 1);
}

/// A band between two parallel regular n-gons is a frustum: `V = h/3 (A₁ + A₂ + √(A₁A₂))`; its sides are trapezoids.
/// The mesh splits them along a diagonal, which changes neither.
#[test]
fn sphere_is_the_polyhedron_it_should_be() {
    for segments in [4, 6, 10, 64] {
        let radius = 0.7_f32;
        let mesh = sphere(radius, segments).unwrap();
        assert_sound(&mesh);
        let (n, bands) = (f64::from(segments), segments / 2);
        let r = f64::from(radius);
        let ring = |band: u32| {
            let angle = PI * f64::from(band) / f64::from(bands);
            (r * angle.sin(), -r * angle.cos())
        };
        let (mut area, mut volume) = (0.0, 0.0);
        for band in 0..bands {
            let ((r1, z1), (r2, z2)) = (ring(band), ring(band + 1));
            let polygon = |radius: f64| n / 2.0 * (TAU / n).sin() * radius * radius;
            let (a1, a2) = (polygon(r1), polygon(r2));
            volume += (z2 - z1) / 3.0 * (a1 + a2 + (a1 * a2).sqrt());
            let (side1, side2) = (2.0 * r1 * (PI / n).sin(), 2.0 * r2 * (PI / n).sin());
            let apothem_step = (r1 - r2) * (PI / n).cos();
            area += n * (side1 + side2) / 2.0 * (z2 - z1).hypot(apothem_step);
        }
        assert_close(mesh.area_m2(), area, ROUNDING, "area");
        assert_close(mesh.volume_m3(), volume, ROUNDING, "volume");
        let topology = Topology::of(&mesh);
        assert!(topology.is_closed());
        assert_eq!(topology.euler_characteristic(), 2);
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            assert!((position.length() - radius).abs() <= 2.0 * f32::EPSILON * radius);
            assert!((*position - *normal * radius).length() <= 2.0 * f32::EPSILON * radius);
        }
    }
}

#[test]
fn sphere_converges_to_the_ball() {
    let [coarse, fine] = [32, 64].map(|segments| 4.0 / 3.0 * PI - sphere(1.0, segments).unwrap().volume_m3());
    // The error of an inscribed polyhedron is of second order in the edge length.
    assert_close(coarse / fine, 4.0, 0.01, "ratio of errors");
}

/// Pappus: area and volume of a turned profile are its length and its area times the way of the centroid. Turned in n
/// steps instead, each r² of the volume counts sin(τ/n)·n/τ.
#[test]
fn ring_obeys_pappus() {
    let sizes = [
        RingSize { inner_radius_m: 0.009, outer_radius_m: 0.0105, height_m: 0.004, bevel_m: 0.0 },
        RingSize { inner_radius_m: 0.009, outer_radius_m: 0.0105, height_m: 0.004, bevel_m: 0.0004 },
        RingSize { inner_radius_m: 0.009, outer_radius_m: 0.011, height_m: 0.006, bevel_m: 0.001 },
        RingSize { inner_radius_m: 0.009, outer_radius_m: 0.011, height_m: 0.002, bevel_m: 0.001 },
    ];
    let (segments, n) = (512, 512.0_f64);
    for size in sizes {
        let mesh = ring(size, segments).unwrap();
        assert_sound(&mesh);
        let [inner, outer, height, bevel] =
            [size.inner_radius_m, size.outer_radius_m, size.height_m, size.bevel_m].map(f64::from);
        let (wall, way) = (outer - inner, PI * (inner + outer));
        // Bevels are 12 chords to a quarter.
        let (corner_length, corner_area) =
            (24.0 * bevel * (PI / 48.0).sin(), 6.0 * bevel * bevel * (PI / 24.0).sin());
        let perimeter = 2.0 * (wall + height) - 8.0 * bevel + 4.0 * corner_length;
        let profile = wall * height - 4.0 * bevel * bevel + 4.0 * corner_area;
        let polygon = (TAU / n).sin() * n / TAU;
        assert_close(mesh.volume_m3(), polygon * way * profile, 10.0 * ROUNDING, "volume");
        // Of the surface upright walls shrink by sin(π/n)·n/π, level ones by `polygon`, which is less.
        assert_close(mesh.area_m2(), way * perimeter, 1.0 - polygon + 10.0 * ROUNDING, "area");
        let topology = Topology::of(&mesh);
        assert!(topology.is_closed(), "{size:?}");
        assert_eq!((topology.euler_characteristic(), topology.components.len()), (0, 1), "{size:?}");
    }
}

#[test]
fn ring_with_round_profile_is_a_torus() {
    let size = RingSize { inner_radius_m: 0.75, outer_radius_m: 1.25, height_m: 0.5, bevel_m: 0.25 };
    let mesh = ring(size, 48).unwrap();
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let on_circle = position.truncate().normalize_or_zero().extend(0.0);
        assert!(((*position - on_circle).length() - 0.25).abs() < 1e-6, "{position}");
        assert!(((*position - on_circle) / 0.25 - *normal).length() < 1e-5, "{position} {normal}");
    }
}

#[test]
fn sealed_teapot_is_three_closed_surfaces() {
    for segments in [2, 3, 10] {
        let mesh = teapot(0.315, segments, TeapotLid::Sealed).unwrap();
        mesh.check().unwrap();
        let topology = Topology::of(&mesh);
        assert!(
            topology.is_closed(),
            "{segments}: {:?}",
            &topology.open_edges[..topology.open_edges.len().min(4)]
        );
        // Three spheres, but the lower end of the handle touches the pot in the one point (−2, 0, 0.9).
        assert_eq!((topology.components.len(), topology.euler_characteristic()), (3, 6 - 1));
        assert!(topology.components.iter().all(|part| part.volume_m3 > 0.0), "{:?}", topology.components);
    }
    assert_sound(&teapot(0.315, 10, TeapotLid::Sealed).unwrap());
}

#[test]
fn teapot_has_newells_measures() {
    let mesh = teapot(3.15, 64, TeapotLid::Open).unwrap();
    assert_sound(&mesh);
    let aabb = mesh.aabb().unwrap();
    // Knob 3.15; handle −3 where its control points stand still (a straight stretch); the body's widest ring is 2.
    assert_close(f64::from(aabb.max.z), 3.15, ROUNDING, "height");
    assert_eq!(aabb.min.z, 0.0);
    assert_close(f64::from(aabb.min.x), -3.0, ROUNDING, "handle");
    assert_close(f64::from(aabb.max.y), 2.0, 1e-3, "body");
    // Edges without a neighbour: rim and lid (4 quarters), both ends of handle and spout (2 halves each).
    assert_eq!(Topology::of(&mesh).open_edges.len(), 64 * (4 + 4 + 4 + 4));
}

/// A teapot tessellated by someone else with ten segments per patch (y up): same triangles, area and extent.
#[test]
fn teapot_is_the_one_everybody_has() {
    let Some(path) = coshade_testdata::find("teapot_is_the_one_everybody_has", "meshes/teapot.obj") else {
        return;
    };
    let theirs = crate::import(path).unwrap().mesh;
    let ours = teapot(3.15, 10, TeapotLid::Open).unwrap();
    assert_eq!(ours.triangle_count(), theirs.triangle_count());
    // Their corners are rounded to 1e-6 of about 2.
    assert_close(ours.area_m2(), theirs.area_m2(), ROUNDING, "area");
    let (ours, theirs) = (ours.aabb().unwrap().size(), theirs.aabb().unwrap().size());
    assert!((ours - Vec3::new(theirs.x, theirs.z, theirs.y)).abs().max_element() < 2e-6, "{ours} {theirs}");
}

/// `V = A₁ ∫ r² dz` over the outline of the pot; A₁ is the area inside the four Bézier quarters that stand for the unit
/// circle. Both integrals are done here from the published outline.
#[test]
fn pot_has_the_volume_of_its_outline() {
    let mesh = teapot(3.15, 64, TeapotLid::Sealed).unwrap();
    let pot = Topology::of(&mesh).components.iter().map(|part| part.volume_m3).fold(0.0, f64::max);
    let bezier = |p: [f64; 4], t: f64| {
        let s = 1.0 - t;
        s * s * s * p[0] + 3.0 * s * s * t * p[1] + 3.0 * s * t * t * p[2] + t * t * t * p[3]
    };
    let steps = 200_000;
    let quarter_points: Vec<[f64; 2]> = (0..=steps)
        .map(|i| {
            let t = f64::from(i) / f64::from(steps);
            [bezier([1.0, 1.0, 0.56, 0.0], t), bezier([0.0, 0.56, 1.0, 1.0], t)]
        })
        .collect();
    let unit_area: f64 =
        2.0 * quarter_points.windows(2).map(|w| w[0][0] * w[1][1] - w[1][0] * w[0][1]).sum::<f64>();
    // r and z of the outline from the bottom to the knob; rings in between are flat and add nothing to ∫ r² dz.
    let outline = [
        ([0.0, 1.425, 1.5, 1.5], [0.0, 0.0, 0.075, 0.15]),
        ([1.5, 1.5, 2.0, 2.0], [0.15, 0.225, 0.45, 0.9]),
        ([2.0, 2.0, 1.75, 1.5], [0.9, 1.35, 1.875, 2.4]),
        ([1.5, 1.4375, 1.3375, 1.4], [2.4, 2.53125, 2.53125, 2.4]),
        ([1.3, 1.3, 0.4, 0.2], [2.4, 2.55, 2.55, 2.7]),
        ([0.2, 0.0, 0.8, 0.0], [2.7, 2.85, 3.15, 3.15]),
    ];
    let mut volume = 0.0;
    for (r, z) in outline {
        for i in 0..20_000 {
            let (t0, t1) = (f64::from(i) / 20_000.0, f64::from(i + 1) / 20_000.0);
            let middle = bezier(r, (t0 + t1) / 2.0);
            volume += unit_area * middle * middle * (bezier(z, t1) - bezier(z, t0));
        }
    }
    // Chords of 64 segments to a quarter: (π/256)² ≈ 1.5e-4 around; the same order along.
    assert_close(pot, volume, 5e-4, "volume of the pot");
}

/// Normals of the patches against central differences of the surface they are the normals of: each vertex normal must
/// match the mean of its triangles' normals better and better as the mesh is refined, poles included.
#[test]
fn teapot_normals_are_those_of_the_surface() {
    let worst = |segments: u32| {
        let mesh = teapot(1.0, segments, TeapotLid::Open).unwrap();
        let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
        for (corners, [a, b, c]) in mesh.triangles().zip(mesh.triangle_positions()) {
            corners.iter().for_each(|&corner| sums[corner as usize] += (b - a).cross(c - a));
        }
        let angle = |(sum, normal): (&Vec3, &Vec3)| sum.angle_between(*normal);
        sums.iter().zip(&mesh.normals).filter(|(sum, _)| **sum != Vec3::ZERO).map(angle).fold(0.0, f32::max)
    };
    let [coarse, fine] = [worst(16), worst(64)];
    assert!(fine < 0.5 * coarse && fine < 0.12, "largest angle {coarse} with 16 segments, {fine} with 64");
}

#[test]
fn knob_and_bottom_point_along_the_axis() {
    let mesh = teapot(3.15, 8, TeapotLid::Open).unwrap();
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        if position.truncate() == Vec2::ZERO && position.z == 0.0 {
            assert!((*normal - Vec3::NEG_Z).length() < 1e-6, "{normal}");
        }
        if position.truncate() == Vec2::ZERO && position.z > 3.1 {
            assert!((*normal - Vec3::Z).length() < 1e-6, "{normal}");
        }
    }
}

#[test]
fn bad_measures_are_named() {
    let text = |result: Result<Mesh, ShapeError>| result.unwrap_err().to_string();
    assert!(text(cuboid(Vec3::new(1.0, 0.0, 1.0))).contains("size_m.y = 0"));
    assert!(text(cuboid(Vec3::new(1.0, 1.0, f32::NAN))).contains("size_m.z = NaN"));
    assert!(text(sphere(-1.0, 32)).contains("radius_m = -1"));
    assert!(text(sphere(1.0, 33)).contains("even"));
    assert!(text(sphere(1.0, u32::MAX)).contains("4 to 2048"));
    assert!(text(plane(Vec2::new(f32::INFINITY, 1.0))).contains("size_m.x = inf"));
    assert!(text(teapot(1.0, 0, TeapotLid::Open)).contains("segments = 0"));
    let size = RingSize { inner_radius_m: 2.0, outer_radius_m: 1.0, height_m: 1.0, bevel_m: 0.0 };
    assert!(text(ring(size, 64)).contains("outer_radius_m = 1"));
    let size = RingSize { inner_radius_m: 1.0, outer_radius_m: 1.2, height_m: 1.0, bevel_m: 0.2 };
    assert!(text(ring(size, 64)).contains("bevel_m = 0.2"));
    assert!(text(ring(RingSize { bevel_m: f32::NAN, ..size }, 64)).contains("bevel_m = NaN"));
}
