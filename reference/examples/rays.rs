//! How fast rays are, against `obvhs`' own traversals, and whether any gets out of a closed mesh.
//!
//! `cargo run -p coshade-reference --example rays [-- <millions of rays>]` (default 10). Speeds are those of one core,
//! measured in turns in the same run; a ratio above 1 means faster than `obvhs`.
#![allow(clippy::print_stdout, reason = "a report")]

use std::sync::Arc;
use std::time::Duration;

use coshade_reference::accel::{Accel, Ray, Sees};
use coshade_reference::random::{hash_words, unit_float};
use coshade_scene::shape::{RingSize, TeapotLid, cuboid, ring, sphere, teapot};
use coshade_scene::{Material, Mesh, Pose, Scene, Thing, World};
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use rayon::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let millions: u32 = std::env::args().nth(1).map_or(Ok(10), |text| text.parse())?;
    let ring_size = RingSize { inner_radius_m: 0.6, outer_radius_m: 1.0, height_m: 0.5, bevel_m: 0.1 };
    let meshes = [
        ("box", cuboid(Vec3::new(2.0, 1.0, 0.5))?),
        ("sphere", sphere(1.0, 256)?),
        ("ring", ring(ring_size, 200)?),
        ("teapot", teapot(1.0, 16, TeapotLid::Sealed)?),
    ];
    println!("mesh      triangles   rays that got out of it, of {millions} million");
    for (name, mesh) in &meshes {
        let lost = leaks(mesh, millions * 1_000_000)?;
        println!(
            "{name:8} {:10}   ours {} / obvhs Bvh2 {} / obvhs CwBvh {}",
            mesh.triangle_count(),
            lost[0],
            lost[1],
            lost[2]
        );
    }
    println!();
    println!("mesh      rays              Mrays/s ours   Bvh2  CwBvh   ratio to the better");
    for (name, mesh) in &meshes {
        speed(name, mesh)?;
    }
    Ok(())
}

fn accel(mesh: &Mesh) -> Result<Accel, Box<dyn std::error::Error>> {
    let thing = Thing {
        name: mesh.name.clone(),
        world: World::Real,
        mesh: Arc::new(mesh.clone()),
        materials: vec![Arc::new(Material::default())],
        pose: Pose::default(),
        hide_marker: false,
    };
    let scene = Scene { things: vec![thing], lights: Vec::new() };
    Ok(Accel::build(&scene, |_| None)?)
}

fn random(index: u32, dimension: u32) -> f32 {
    unit_float(hash_words(&[index, dimension]))
}

fn random_direction(index: u32, first: u32) -> Vec3 {
    let z = 1.0 - 2.0 * random(index, first);
    let across = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * random(index, first + 1)).sin_cos();
    Vec3::new(across * cos, across * sin, z)
}

/// A ray from inside: the middle of the mesh moved a little, or the point halfway between a surface point and the next
/// surface behind it; aimed anywhere, or exactly at a corner, or at a point of an edge.
fn inner_ray(mesh: &Mesh, accel: &Accel, index: u32) -> Ray {
    let count = mesh.triangle_count() as u32;
    let triangle = (hash_words(&[index, 0]) % count) as usize;
    let [a, b, c] = mesh.triangle(triangle).unwrap_or_default().map(|corner| mesh.positions[corner as usize]);
    let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
    let on_surface = (a + b + c) / 3.0 - normal * 1e-4;
    let across = Ray::new(on_surface, -normal, 0);
    let thickness = accel.closest(&across, Sees::Everything).map_or(0.0, |hit| hit.t);
    let origin = across.at(thickness * (0.1 + 0.8 * random(index, 1)));
    let other = (hash_words(&[index, 2]) % count) as usize;
    let [a, b, c] = mesh.triangle(other).unwrap_or_default().map(|corner| mesh.positions[corner as usize]);
    let direction = match index % 4 {
        0 => random_direction(index, 3),
        1 => a - origin,
        2 => a.lerp(b, random(index, 3)) - origin,
        _ => b.lerp(c, 0.5) - origin,
    };
    Ray::new(origin, direction, index)
}

fn leaks(mesh: &Mesh, count: u32) -> Result<[usize; 3], Box<dyn std::error::Error>> {
    let accel = accel(mesh)?;
    let peers = Peers::of(mesh);
    let lost = |index: u32| {
        let ray = inner_ray(mesh, &accel, index);
        if ray.direction == Vec3::ZERO {
            return [0; 3];
        }
        let unit = Ray { direction: ray.direction.normalize_or(Vec3::Z), ..ray };
        let ours = accel.closest(&ray, Sees::Everything).is_none() || !accel.occluded(&ray, Sees::Everything);
        [usize::from(ours), usize::from(!peers.bvh2_hits(&unit)), usize::from(!peers.cwbvh_hits(&unit))]
    };
    let sum = |a: [usize; 3], b: [usize; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
    Ok((0..count).into_par_iter().map(lost).reduce(|| [0; 3], sum))
}

/// `obvhs` as its examples use it: triangles in the order of the leaves, Möller–Trumbore.
struct Peers {
    bvh2: (Bvh2, Vec<RtTriangle>),
    cwbvh: (CwBvh, Vec<RtTriangle>),
}

impl Peers {
    fn of(mesh: &Mesh) -> Self {
        let triangles: Vec<Triangle> = mesh
            .triangle_positions()
            .map(|[a, b, c]| Triangle { v0: a.into(), v1: b.into(), v2: c.into() })
            .collect();
        let build = BvhBuildParams::medium_build();
        let bvh2 = build_bvh2_from_tris(&triangles, build, &mut Duration::default());
        let cwbvh = build_cwbvh_from_tris(&triangles, build, &mut Duration::default());
        let ordered = |indices: &[u32]| {
            indices.iter().map(|&index| RtTriangle::from(&triangles[index as usize])).collect()
        };
        Self {
            bvh2: (bvh2.clone(), ordered(&bvh2.primitive_indices)),
            cwbvh: (cwbvh.clone(), ordered(&cwbvh.primitive_indices)),
        }
    }

    fn bvh2_closest(&self, ray: &Ray) -> f32 {
        let mut hit = RayHit::none();
        self.bvh2.0.ray_traverse(theirs(ray), &mut hit, |ray, id| self.bvh2.1[id].intersect(ray));
        hit.t
    }

    fn cwbvh_closest(&self, ray: &Ray) -> f32 {
        let mut hit = RayHit::none();
        self.cwbvh.0.ray_traverse(theirs(ray), &mut hit, |ray, id| self.cwbvh.1[id].intersect(ray));
        hit.t
    }

    fn bvh2_hits(&self, ray: &Ray) -> bool {
        !self.bvh2.0.ray_traverse_miss(theirs(ray), |ray, id| self.bvh2.1[id].intersect(ray))
    }

    fn cwbvh_hits(&self, ray: &Ray) -> bool {
        !self.cwbvh.0.ray_traverse_miss(theirs(ray), |ray, id| self.cwbvh.1[id].intersect(ray))
    }
}

fn theirs(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(Vec3A::from(ray.origin), Vec3A::from(ray.direction), ray.t_min, ray.t_max)
}

const RAYS: u32 = 200_000;

/// Seen from a camera, pixel by pixel.
fn coherent_rays() -> Vec<Ray> {
    let width = 500;
    let camera = Vec3::new(2.5, -2.0, 1.5);
    let forward = (Vec3::new(0.0, 0.0, 0.2) - camera).normalize_or(Vec3::X);
    let right = forward.cross(Vec3::Z).normalize_or(Vec3::X);
    let up = right.cross(forward);
    let ray = |index: u32| {
        let x = (index % width) as f32 / width as f32 - 0.5;
        let y = (index / width) as f32 / (RAYS / width) as f32 - 0.5;
        Ray::new(camera, (forward + right * x * 0.9 - up * y * 0.9).normalize_or(forward), 0)
    };
    (0..RAYS).map(ray).collect()
}

/// Chords of a ball around everything.
fn incoherent_rays() -> Vec<Ray> {
    let ray = |index: u32| {
        let (from, to) = (random_direction(index, 0) * 1.3, random_direction(index, 2) * 1.3);
        Ray::new(from, (to - from).normalize_or(Vec3::Z), 0)
    };
    (0..RAYS).map(ray).collect()
}

fn speed(name: &str, mesh: &Mesh) -> Result<(), Box<dyn std::error::Error>> {
    let accel = accel(mesh)?;
    let peers = Peers::of(mesh);
    for (kind, rays) in [("coherent", coherent_rays()), ("incoherent", incoherent_rays())] {
        let closest: [&dyn Fn(&Ray) -> bool; 3] = [
            &|ray| accel.closest(ray, Sees::Everything).is_some(),
            &|ray| peers.bvh2_closest(ray).is_finite(),
            &|ray| peers.cwbvh_closest(ray).is_finite(),
        ];
        report(name, kind, "closest", &rays, closest);
        let any: [&dyn Fn(&Ray) -> bool; 3] =
            [&|ray| accel.occluded(ray, Sees::Everything), &|ray| peers.bvh2_hits(ray), &|ray| {
                peers.cwbvh_hits(ray)
            }];
        report(name, kind, "any", &rays, any);
    }
    Ok(())
}

/// The fastest of several turns each.
fn report(name: &str, kind: &str, query: &str, rays: &[Ray], cast: [&dyn Fn(&Ray) -> bool; 3]) {
    let mut best = [f64::INFINITY; 3];
    let mut hits = [0; 3];
    for _ in 0..7 {
        for (peer, cast) in cast.iter().enumerate() {
            #[expect(clippy::disallowed_methods, reason = "measures computing time, nothing is replayed")]
            let start = std::time::Instant::now();
            hits[peer] = rays.iter().filter(|ray| cast(ray)).count();
            best[peer] = best[peer].min(start.elapsed().as_secs_f64());
        }
    }
    let speed = best.map(|seconds| rays.len() as f64 / seconds / 1e6);
    let ratio = speed[0] / speed[1].max(speed[2]);
    println!(
        "{name:9} {kind:10} {query:8} {:8.2} {:6.2} {:6.2}   {ratio:.2}   hits {hits:?}",
        speed[0], speed[1], speed[2]
    );
}
