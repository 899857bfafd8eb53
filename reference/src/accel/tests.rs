use super::*;
use crate::random::{hash_words, unit_float};
use coshade_scene::shape::{RingSize, TeapotLid, cuboid, plane, ring, sphere, teapot};
use coshade_scene::texture::{ColorSpace, Filter, Image, Texture};
use coshade_scene::{AlphaMode, Material, Mesh, Thing, World};
use glam::{DVec3, Quat, Vec2, Vec3, Vec4};

fn thing(name: &str, world: World, mesh: Mesh, material: Material, position: Vec3) -> Thing {
    Thing {
        name: name.into(),
        world,
        mesh: Arc::new(mesh),
        materials: vec![Arc::new(material)],
        pose: Pose::World(Similarity::from_translation(position)),
        hide_marker: false,
    }
}

fn accel_of(things: Vec<Thing>) -> Accel {
    Accel::build(&Scene { things, lights: Vec::new() }, |_| None).unwrap()
}

fn alone(mesh: Mesh) -> Accel {
    accel_of(vec![thing("alone", World::Real, mesh, Material::default(), Vec3::ZERO)])
}

fn random(index: u32, dimension: u32) -> f32 {
    unit_float(hash_words(&[index, dimension, 31]))
}

fn direction(index: u32, first: u32) -> Vec3 {
    let z = 1.0 - 2.0 * random(index, first);
    let across = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * random(index, first + 1)).sin_cos();
    Vec3::new(across * cos, across * sin, z)
}

fn closed_meshes() -> Vec<Mesh> {
    let size = RingSize { inner_radius_m: 0.6, outer_radius_m: 1.0, height_m: 0.4, bevel_m: 0.2 };
    vec![
        cuboid(Vec3::new(2.0, 1.0, 0.5)).unwrap(),
        sphere(1.0, 64).unwrap(),
        ring(size, 60).unwrap(),
        teapot(1.0, 6, TeapotLid::Sealed).unwrap(),
    ]
}

/// From inside of closed meshes no ray gets out, aimed anywhere, exactly at corners, or exactly at points of edges:
/// 1.2 million rays. (The example `rays` does 40 million.)
#[test]
fn nothing_gets_out_of_a_closed_mesh() {
    for mesh in closed_meshes() {
        let accel = alone(mesh.clone());
        let corner = |index: u32, dimension: u32| {
            let triangle = hash_words(&[index, dimension]) as usize % mesh.triangle_count();
            mesh.triangle(triangle).unwrap().map(|corner| mesh.positions[corner as usize])
        };
        for index in 0..75_000 {
            let [a, b, c] = corner(index, 0);
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
            let across = Ray::new((a + b + c) / 3.0 - normal * 1e-4, -normal, 0);
            let thickness = accel.closest(&across, Sees::Everything).unwrap().t;
            let origin = across.at(thickness * (0.1 + 0.8 * random(index, 1)));
            let [a, b, _] = corner(index, 2);
            for towards in [
                direction(index, 3),
                a - origin,
                a.lerp(b, random(index, 5)) - origin,
                a.midpoint(b) - origin,
            ] {
                let ray = Ray::new(origin, towards, index);
                assert!(accel.closest(&ray, Sees::Everything).is_some(), "{} {ray:?}", mesh.name);
                assert!(accel.occluded(&ray, Sees::Everything), "{} {ray:?}", mesh.name);
            }
        }
    }
}

/// Rays that leave a surface at its own place: into a closed body none gets out, outwards of a convex one none comes
/// back to it. At many scales and far from the world's origin, where coordinates have few digits.
#[test]
fn rays_that_leave_a_surface_stay_on_their_side() {
    for (mesh, convex) in closed_meshes().into_iter().zip([true, true, false, false]) {
        for (scale, position) in
            [(1.0, Vec3::ZERO), (0.01, Vec3::new(3.0, -2.0, 1.0)), (50.0, Vec3::splat(100.0))]
        {
            let mut body = thing("body", World::Real, mesh.clone(), Material::default(), position);
            let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
            body.pose = Pose::World(Similarity { rotation, translation_m: position, scale });
            let accel = accel_of(vec![body]);
            for index in 0..10_000 {
                let outside = position + direction(index, 0) * 3.0 * scale;
                let target =
                    position + Vec3::new(random(index, 2), random(index, 3), random(index, 4)) * 0.2 * scale;
                let ray = Ray::new(outside, target - outside, index);
                let Some(hit) = accel.closest(&ray, Sees::Everything) else {
                    continue;
                };
                let surface = accel.surface(&ray, &hit);
                let leaving = direction(index, 5);
                let from = Ray::new(surface.origin_towards(leaving), leaving, 0);
                let inward = leaving.dot(surface.geometric_normal) < 0.0;
                let hits = accel.closest(&from, Sees::Everything);
                assert!(!inward || hits.is_some(), "{} at scale {scale}: got out, {from:?}", mesh.name);
                // A coarse ball's facets are convex to rounding only; rays along the surface may graze the next one.
                let grazing = leaving.dot(surface.geometric_normal).abs() < 1e-3;
                assert!(
                    inward || !convex || grazing || hits.is_none(),
                    "{} at scale {scale}: {from:?}",
                    mesh.name
                );
            }
        }
    }
}

/// A point on a wall of a box, straight in its edge or corner: the ray into the room never gets out.
#[test]
fn edges_and_corners_of_a_room_are_tight() {
    let size = Vec3::new(2.0, 1.0, 0.5);
    let accel = alone(cuboid(size).unwrap());
    for index in 0..50_000 {
        // At the edge to within rounding, from the middle of the room.
        let edge = size / 2.0
            * Vec3::new(1.0, 2.0 * random(index, 0) - 1.0, if index % 3 == 0 { 1.0 } else { 0.999_999 });
        let ray = Ray::new(Vec3::new(0.1, 0.05, 0.02), edge - Vec3::new(0.1, 0.05, 0.02), 0);
        let hit = accel.closest(&ray, Sees::Everything).unwrap();
        let surface = accel.surface(&ray, &hit);
        let towards = direction(index, 1);
        let into_room = -towards.dot(surface.geometric_normal).signum() * towards;
        let next = Ray::new(surface.origin_towards(into_room), into_room, 0);
        assert!(accel.closest(&next, Sees::Everything).is_some(), "{next:?}");
    }
}

/// A loop over all triangles in f64, Möller and Trumbore's formula.
fn brute_force(accel: &Accel, ray: &Ray) -> Option<f64> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let hit = |triangle: u32| -> Option<f64> {
        let [a, b, c] = accel.geometry().corners(triangle).map(|corner| corner.as_dvec3());
        let (e1, e2): (DVec3, DVec3) = (b - a, c - a);
        let p = d.cross(e2);
        let determinant = e1.dot(p);
        let s = (o - a) / determinant;
        let (u, q) = (s.dot(p), s.cross(e1));
        let (v, t) = (d.dot(q), e2.dot(q));
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
    };
    (0..accel.geometry().triangle_count()).filter_map(hit).min_by(f64::total_cmp)
}

#[test]
fn closest_hits_are_those_of_a_plain_loop() {
    for mesh in closed_meshes() {
        let accel = alone(mesh.clone());
        for index in 0..1500 {
            let from = direction(index, 0) * 2.0;
            let ray = Ray::new(from, direction(index, 2) * 0.7 - from, 0);
            let (ours, plain) = (accel.closest(&ray, Sees::Everything), brute_force(&accel, &ray));
            // Rays that touch an outline to within rounding may go either way.
            match (ours, plain) {
                (Some(hit), Some(t)) => assert!((f64::from(hit.t) - t).abs() < 1e-5 * t, "{}", mesh.name),
                (None, None) => {}
                either => panic!("{}: {either:?}", mesh.name),
            }
            assert_eq!(ours.is_some(), accel.occluded(&ray, Sees::Everything));
        }
    }
}

#[test]
fn rays_of_the_real_world_pass_through_virtual_things() {
    let ball = || sphere(0.5, 16).unwrap();
    let accel = accel_of(vec![
        thing("virtual", World::Virtual, ball(), Material::default(), Vec3::X * 2.0),
        thing("real", World::Real, ball(), Material::default(), Vec3::X * 4.0),
    ]);
    let ray = Ray::new(Vec3::new(0.0, 0.01, 0.02), Vec3::X, 0);
    let near = accel.closest(&ray, Sees::Everything).unwrap();
    let far = accel.closest(&ray, Sees::RealOnly).unwrap();
    assert!((near.t - 1.5).abs() < 0.02 && (far.t - 3.5).abs() < 0.02);
    assert_eq!(accel.surface(&ray, &near).world, World::Virtual);
    assert_eq!(accel.surface(&ray, &far).world, World::Real);
    let before_the_real_one = Ray { t_max: 3.0, ..ray };
    assert!(accel.occluded(&before_the_real_one, Sees::Everything));
    assert!(!accel.occluded(&before_the_real_one, Sees::RealOnly));
    assert!(accel.closest(&Ray { t_min: 5.0, ..ray }, Sees::Everything).is_none());
}

fn chequered(mode: AlphaMode) -> Accel {
    let image = Image {
        name: "holes".into(),
        width: 2,
        height: 1,
        rgba: vec![255, 255, 255, 255, 255, 255, 255, 64],
    };
    let texture = Texture { magnify: Filter::Nearest, ..Texture::new(Arc::new(image), ColorSpace::Srgb) };
    let material = Material {
        base_color: Vec4::ONE,
        base_color_texture: Some(Arc::new(texture)),
        alpha_mode: mode,
        ..Material::default()
    };
    accel_of(vec![thing("sheet", World::Real, plane(Vec2::ONE).unwrap(), material, Vec3::ZERO)])
}

#[test]
fn masks_make_holes_for_every_kind_of_ray() {
    let down = |x: f32, seed| Ray::new(Vec3::new(x, 0.1, 1.0), -Vec3::Z, seed);
    for (mode, there, hole) in [
        (AlphaMode::Opaque, true, true),
        (AlphaMode::Mask { cutoff: 0.5 }, true, false),
        (AlphaMode::Mask { cutoff: 0.2 }, true, true),
    ] {
        let accel = chequered(mode);
        for (x, expected) in [(-0.25, there), (0.25, hole)] {
            assert_eq!(accel.closest(&down(x, 0), Sees::Everything).is_some(), expected);
            assert_eq!(accel.occluded(&down(x, 0), Sees::RealOnly), expected);
        }
    }
}

/// Of 20000 rays the share alpha = 64/255 is stopped, within 5 standard deviations; a seed decides the same for both
/// kinds of query and for both worlds.
#[test]
fn blending_stops_the_share_alpha() {
    let accel = chequered(AlphaMode::Blend);
    let stopped = (0..20_000)
        .filter(|&seed| {
            let ray = Ray::new(Vec3::new(0.25, 0.1, 1.0), -Vec3::Z, seed);
            let occluded = accel.occluded(&ray, Sees::Everything);
            assert_eq!(occluded, accel.closest(&ray, Sees::RealOnly).is_some());
            occluded
        })
        .count();
    let (expected, deviation) = (20_000.0 * 64.0 / 255.0, (20_000.0_f64 * 0.251 * 0.749).sqrt());
    assert!((stopped as f64 - expected).abs() < 5.0 * deviation, "{stopped}");
}

#[test]
fn strange_rays_hit_nothing_and_do_no_harm() {
    let accel = alone(sphere(1.0, 16).unwrap());
    for bad in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(f32::MAX)] {
        for (origin, towards) in [(bad, Vec3::X), (Vec3::new(2.0, 0.1, 0.1), bad)] {
            let ray = Ray::new(origin, towards, 0);
            let hit = accel.closest(&ray, Sees::Everything);
            assert!(
                hit.is_none_or(|hit| hit.t.is_finite() && hit.barycentric.is_finite()),
                "{ray:?} {hit:?}"
            );
        }
    }
    let nothing = accel_of(Vec::new());
    assert!(!nothing.occluded(&Ray::new(Vec3::ZERO, Vec3::X, 0), Sees::Everything));
}

/// Along axes, in the planes of box faces and of edges, with −0: the directions in which slabs have 0/0.
#[test]
fn axis_parallel_rays_find_box_faces_and_edges() {
    let accel = alone(cuboid(Vec3::ONE).unwrap());
    for zero in [0.0, -0.0, 1e-30, -1e-30] {
        for y in [0.0, 0.25, 0.5, -0.5] {
            // Along a face of the box, and away from it by however little: a miss.
            let misses = zero * y > 0.0 && f32::abs(y) == 0.5;
            let ray = Ray::new(Vec3::new(-2.0, y, 0.1), Vec3::new(1.0, zero, zero), 0);
            let hit = accel.closest(&ray, Sees::Everything);
            assert_eq!(hit.is_none(), misses, "y = {y}, {zero}: {hit:?}");
            assert!(hit.is_none_or(|hit| (hit.t - 1.5).abs() < 1e-6));
        }
    }
}

#[test]
fn scenes_that_cannot_be_traced_are_named() {
    let build = |thing: Thing, frame: Option<Similarity>| {
        Accel::build(&Scene { things: vec![thing], lights: Vec::new() }, |_| frame).unwrap_err().to_string()
    };
    let cube = || cuboid(Vec3::ONE).unwrap();
    let good = |mesh| thing("cube", World::Real, mesh, Material::default(), Vec3::ZERO);
    let marker = |marker_from_thing| Pose::Marker {
        family: "tag36h11".into(),
        id: 7,
        size_m: 0.05,
        marker_from_thing,
    };
    let lost = Thing { pose: marker(Similarity::IDENTITY), ..good(cube()) };
    assert!(
        build(lost, None).contains("'cube'")
            && build(Thing { pose: marker(Similarity::IDENTITY), ..good(cube()) }, None)
                .contains("tag36h11 7")
    );
    let flat = Thing { pose: marker(Similarity { scale: 0.0, ..Similarity::IDENTITY }), ..good(cube()) };
    assert!(build(flat, Some(Similarity::IDENTITY)).contains("scale"));
    let mut broken = cube();
    broken.positions[3].y = f32::NAN;
    assert!(build(good(broken), None).contains("vertex 3"));
    let mut out_of_range = cube();
    out_of_range.indices[4] = 99;
    assert!(build(good(out_of_range), None).contains("99"));
    assert!(build(Thing { materials: Vec::new(), ..good(cube()) }, None).contains("slot 0"));
}
