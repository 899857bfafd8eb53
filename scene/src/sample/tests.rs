//! Counts against areas, moments against closed forms, and the same for prefixes.

use glam::{DMat3, DVec3, Quat};

use super::*;
use crate::shape::{TeapotLid, cuboid, plane, sphere, teapot};

fn sampler(mesh: &Mesh, seed: u64) -> SurfaceSampler<'_> {
    SurfaceSampler::new([(mesh, Similarity::IDENTITY)], seed).unwrap()
}

/// Mean and second moments `E[x xᵀ]`.
fn moments(points: impl Iterator<Item = SurfacePoint>) -> (DVec3, DMat3) {
    let (mut mean, mut second, mut count) = (DVec3::ZERO, DMat3::ZERO, 0.0);
    for point in points {
        let p = point.position.as_dvec3();
        mean += p;
        second += DMat3::from_cols(p * p.x, p * p.y, p * p.z);
        count += 1.0;
    }
    (mean / count, second * (1.0 / count))
}

/// χ² of counts per triangle against areas. For independent points it has k − 1 degrees of freedom, a mean of k − 1 and a
/// deviation of √(2(k − 1)); a low-discrepancy sequence must lie far below, and above 5 deviations is wrong either way.
#[test]
fn counts_follow_areas() {
    let mesh = teapot(1.0, 4, TeapotLid::Sealed).unwrap();
    let sampler = sampler(&mesh, 7);
    let areas: Vec<f64> = mesh.triangle_positions().map(|[a, b, c]| triangle_area_m2(a, b, c)).collect();
    for count in [100_000_u32, 30_000] {
        let mut counts = vec![0.0; areas.len()];
        sampler.range(0..count, 100_000).for_each(|point| counts[point.triangle as usize] += 1.0);
        let expected = |area: f64| area / sampler.total_area_m2() * f64::from(count);
        let chi2: f64 =
            counts.iter().zip(&areas).map(|(n, &area)| (n - expected(area)).powi(2) / expected(area)).sum();
        let freedom = areas.len() as f64 - 1.0;
        assert!(chi2 < freedom, "{count} points: χ² = {chi2} with {freedom} degrees of freedom");
        // One-dimensional stratification: no triangle is off by more than a few points.
        let worst =
            counts.iter().zip(&areas).map(|(n, &area)| (n - expected(area)).abs()).fold(0.0, f64::max);
        assert!(worst < 8.0, "{count} points: off by {worst}");
    }
}

/// A right triangle cut into 16 equal ones: each must get its sixteenth.
#[test]
fn points_are_uniform_within_a_triangle() {
    let mut mesh = plane(Vec2::ONE).unwrap();
    mesh.indices.truncate(3);
    mesh.parts[0].triangles = 0..1;
    let [a, b, c] = mesh.triangle_positions().next().unwrap();
    for seed in 0..4 {
        let mut counts = [0_u32; 16];
        for point in sampler(&mesh, seed).points(16_000) {
            // Barycentric coordinates in quarters, and which of the two small triangles of a cell.
            let total = triangle_area_m2(a, b, c);
            let (s, t) = (
                triangle_area_m2(a, point.position, c) / total * 4.0,
                triangle_area_m2(a, b, point.position) / total * 4.0,
            );
            let (i, j) = ((s as usize).min(3), (t as usize).min(3));
            let upper = usize::from(s.fract() + t.fract() > 1.0 && i + j < 3);
            // Rows of 7, 5, 3 and 1 small triangles.
            counts[i * (8 - i) + 2 * j.min(3 - i) + upper] += 1;
        }
        // Independent points would deviate by √1000 ≈ 32 each.
        assert!(counts.iter().all(|&n| (940..=1060).contains(&n)), "seed {seed}: {counts:?}");
    }
}

/// Uniform on the sphere: mean 0, `E[x xᵀ] = r²/3`. The polyhedron of 128 segments differs by (π/128)² ≈ 6e-4. The mean
/// of random points would be off by 2/√n; half of that is asked for.
#[test]
fn sphere_has_its_moments() {
    let mesh = sphere(2.0, 128).unwrap();
    for seed in 0..4 {
        for count in [1000_u32, 20_000] {
            let (mean, second) = moments(sampler(&mesh, seed).points(count));
            let random = 2.0 / f64::from(count).sqrt();
            assert!(mean.length() < 0.5 * random, "seed {seed}, {count}: mean {mean} against {random}");
            let error = second - DMat3::from_diagonal(DVec3::splat(4.0 / 3.0));
            let worst = error.to_cols_array().into_iter().fold(0.0, |worst: f64, e| worst.max(e.abs()));
            assert!(worst < 4.0 * (6e-4 + 0.5 / f64::from(count).sqrt()), "seed {seed}, {count}: {error}");
        }
    }
}

/// Surface of a box a × b × c: `E[x²]` = a²/12 on the four sides it runs along, a²/4 on the two it ends at.
#[test]
fn box_has_its_moments() {
    let size = DVec3::new(3.0, 1.0, 0.5);
    let mesh = cuboid(size.as_vec3()).unwrap();
    let (mean, second) = moments(sampler(&mesh, 3).points(50_000));
    let [a, b, c] = size.to_array();
    let (bc, ca, ab) = (b * c, c * a, a * b);
    let all = bc + ca + ab;
    let expected = DVec3::new(
        a * a * (bc / 4.0 + (ca + ab) / 12.0) / all,
        b * b * (ca / 4.0 + (ab + bc) / 12.0) / all,
        c * c * (ab / 4.0 + (bc + ca) / 12.0) / all,
    );
    let found = DVec3::new(second.x_axis.x, second.y_axis.y, second.z_axis.z);
    assert!((found - expected).abs().max_element() < 2e-3, "{found} {expected}");
    assert!(mean.length() < 5e-3, "{mean}");
}

#[test]
fn area_and_shares_are_exact() {
    let small = cuboid(Vec3::new(1.0, 2.0, 3.0)).unwrap();
    let big = plane(Vec2::new(4.0, 5.0)).unwrap();
    let turned = Similarity { rotation: Quat::from_rotation_x(1.0), translation_m: Vec3::X, scale: 2.0 };
    let sampler = SurfaceSampler::new([(&small, turned), (&big, Similarity::IDENTITY)], 1).unwrap();
    let expected = 4.0 * 22.0 + 20.0;
    assert!((sampler.total_area_m2() / expected - 1.0).abs() < 1e-12, "{}", sampler.total_area_m2());
    let points: Vec<_> = sampler.points(2000).collect();
    let sum: f64 = points.iter().map(|point| f64::from(point.area_m2)).sum();
    assert!((sum / expected - 1.0).abs() < 1e-6, "{sum}");
    let on_plane = points.iter().filter(|point| point.thing == 1).count() as f64;
    assert!((on_plane - 2000.0 * 20.0 / expected).abs() < 3.0, "{on_plane}");
}

/// Points lie on their triangle, normals and uv are those of the place.
#[test]
fn attributes_belong_to_the_point() {
    let mesh = sphere(1.0, 64).unwrap();
    let placed = Similarity {
        rotation: Quat::from_rotation_y(0.4),
        translation_m: Vec3::new(1.0, 2.0, 3.0),
        scale: 0.5,
    };
    let sampler = SurfaceSampler::new([(&mesh, placed)], 5).unwrap();
    for point in sampler.points(500) {
        let own = placed.inverse().transform_point(point.position);
        // A chord of 1/64 turn is at most 1 − cos(π/64) ≈ 1.2e-3 inside, in both directions.
        assert!((0.997..=1.0001).contains(&own.length()), "{own}");
        let radial = placed.transform_direction(own.normalize_or_zero());
        assert!(point.normal.is_normalized() && point.normal.dot(radial) > 0.999);
        let latitude = (own.z / own.length()).asin();
        assert!(
            (point.uv.y - (0.5 - latitude / std::f32::consts::PI)).abs() < 0.01,
            "{} {latitude}",
            point.uv
        );
        assert_eq!(point.part, 0);
    }
}

/// The first n points are the same whatever the total, and any n of them are spread like a set made for n: the largest
/// error of a count over all prefixes stays below half of √n/2, random points' deviation at the end alone.
#[test]
fn every_prefix_is_well_spread() {
    let mesh = plane(Vec2::ONE).unwrap();
    let sampler = sampler(&mesh, 11);
    let all: Vec<_> = sampler.points(4096).map(|point| point.position).collect();
    let few: Vec<_> = sampler.points(100).map(|point| point.position).collect();
    assert_eq!(all[..100], few[..]);
    let halves: [fn(&Vec3) -> bool; 3] = [|p| p.x > 0.0, |p| p.y > 0.0, |p| p.x + p.y > 0.0];
    for half in halves {
        let (mut inside, mut worst) = (0.0_f64, 0.0_f64);
        for (n, point) in all.iter().enumerate() {
            inside += f64::from(u8::from(half(point)));
            worst = worst.max((inside - (n as f64 + 1.0) / 2.0).abs());
        }
        assert!(worst < 16.0, "off by {worst} of 4096");
    }
}

#[test]
fn seeds_differ_and_repeat() {
    let mesh = cuboid(Vec3::ONE).unwrap();
    let points = |seed| sampler(&mesh, seed).points(64).map(|point| point.position).collect::<Vec<_>>();
    assert_eq!(points(1), points(1));
    assert_ne!(points(1), points(2));
}

#[test]
fn nothing_to_sample_is_an_error() {
    let empty = Mesh::default();
    assert_eq!(SurfaceSampler::new([(&empty, Similarity::IDENTITY)], 0).unwrap_err(), SampleError::NoArea);
    let mut flat = plane(Vec2::ONE).unwrap();
    flat.positions.iter_mut().for_each(|position| *position = Vec3::ZERO);
    assert_eq!(SurfaceSampler::new([(&flat, Similarity::IDENTITY)], 0).unwrap_err(), SampleError::NoArea);
    let mut broken = plane(Vec2::ONE).unwrap();
    broken.indices[0] = 99;
    let error = SurfaceSampler::new([(&broken, Similarity::IDENTITY)], 0).unwrap_err();
    assert!(error.to_string().contains("index 99"), "{error}");
}

#[test]
fn triangles_without_area_get_no_points() {
    let mut mesh = plane(Vec2::ONE).unwrap();
    mesh.indices.splice(0..0, [0, 0, 1]);
    mesh.indices.extend([2, 2, 2]);
    mesh.parts[0].triangles = 0..4;
    assert!(sampler(&mesh, 0).points(1000).all(|point| (1..3).contains(&point.triangle)));
}
