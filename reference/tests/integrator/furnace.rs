//! Surroundings of radiance 1: what reflects everything becomes invisible, the rest shows its albedo.

use std::f64::consts::{PI, TAU};

use coshade_reference::integrator::Settings;
use coshade_reference::job::JobOptions;
use coshade_scene::shape::{cuboid, sphere};
use coshade_scene::{Material, Scene};
use glam::Vec3;

use crate::studio::*;

fn deep(count: u32) -> JobOptions {
    JobOptions { settings: Settings { max_depth: 10_000, ..Settings::default() }, ..samples(count) }
}

/// White walls: all light comes back, after any number of bounces.
#[test]
fn white_lambert_corner_is_white() {
    let walls = [
        real(square(1.0), lambert(Vec3::ONE), at(0.0, 0.0, 0.0)),
        real(square(1.0), lambert(Vec3::ONE), facing(Vec3::new(-0.5, 0.0, 0.5), Vec3::X)),
        real(square(1.0), lambert(Vec3::ONE), facing(Vec3::new(0.0, -0.5, 0.5), Vec3::Y)),
    ];
    let scene = trace(&Scene { things: walls.into(), lights: Vec::new() }, white_sky());
    let camera = peephole(Vec3::new(2.0, 2.0, 2.0), Vec3::new(-0.2, -0.2, 0.2), 0.8, 16);
    let film = picture(&scene, &camera, &deep(128));
    mixed_of(&film).is(Vec3::ONE, 1e-5, 1e-2);
}

/// Glass that absorbs nothing is invisible: every path leaves with the weight it came with. Facets, so that light obeys
/// the true surface.
#[test]
fn clear_glass_is_invisible() {
    for mesh in [faceted_ball(0.5, 24), cuboid(Vec3::new(0.5, 0.7, 0.9)).unwrap()] {
        let body = real(mesh, Material::glass(1.5), at(0.0, 0.0, 0.0));
        let scene = trace(&Scene { things: vec![body], lights: Vec::new() }, white_sky());
        let camera = peephole(Vec3::new(3.0, 1.0, 2.0), Vec3::ZERO, 1.2, 16);
        let film = picture(&scene, &camera, &deep(64));
        mixed_of(&film).is(Vec3::ONE, 1e-5, 5e-3);
        assert!(film.pixels.iter().any(|pixel| pixel.depth_m > 0.0), "the glass is there");
    }
}

/// Directional albedo of a GGX metal, `∫ D G2 F / (4 cosθ_o) dω_i` (Walter et al. 2007; Heitz 2014, eq. 99), written anew.
fn metal_albedo(f0: f64, alpha: f64, cos_out: f64) -> f64 {
    let lambda = |cos: f64| ((1.0 + alpha * alpha * (1.0 / (cos * cos) - 1.0)).sqrt() - 1.0) / 2.0;
    let out = [(1.0 - cos_out * cos_out).sqrt(), 0.0, cos_out];
    let (rows, columns) = (600, 600);
    let mut sum = 0.0;
    for row in 0..rows {
        let cos_in = (row as f64 + 0.5) / rows as f64;
        let sin_in = (1.0 - cos_in * cos_in).sqrt();
        for column in 0..columns {
            let phi = (column as f64 + 0.5) / columns as f64 * TAU;
            let half = [out[0] + sin_in * phi.cos(), sin_in * phi.sin(), out[2] + cos_in];
            let length = half.iter().map(|part| part * part).sum::<f64>().sqrt();
            let cos_half = half[2] / length;
            let out_half = (out[0] * half[0] + out[2] * half[2]) / length;
            let bump = (alpha * alpha - 1.0) * cos_half * cos_half + 1.0;
            let d = alpha * alpha / (PI * bump * bump);
            let g2 = 1.0 / (1.0 + lambda(cos_in) + lambda(cos_out));
            let fresnel = f0 + (1.0 - f0) * (1.0 - out_half).powi(5);
            sum += d * g2 * fresnel / (4.0 * cos_out) * TAU / (rows * columns) as f64;
        }
    }
    sum
}

#[test]
fn rough_metal_shows_its_albedo() {
    for (f0, roughness, angle_deg) in [(1.0, 0.5, 0.0), (1.0, 1.0, 60.0), (0.5, 0.7, 75.0)] {
        let metal = Material::metal(Vec3::splat(f0 as f32), roughness);
        let scene = Scene { things: vec![real(square(1.0), metal, at(0.0, 0.0, 0.0))], lights: Vec::new() };
        let (sin, cos) = f64::to_radians(angle_deg).sin_cos();
        let eye = Vec3::new(sin as f32, 0.0, cos as f32) * 3.0;
        let film = picture(&trace(&scene, white_sky()), &peephole(eye, Vec3::ZERO, 0.001, 8), &samples(1024));
        let expected = metal_albedo(f0, f64::from(roughness * roughness), cos) as f32;
        // The quadrature's own error: midpoints of a lobe 0.25 wide, 600 of them.
        mixed_of(&film).is(Vec3::splat(expected), 1e-3, 4e-3);
    }
}

/// A closed room whose walls glow: L = E + ρ L, so L = E/(1 − ρ), whatever its shape.
#[test]
fn glowing_room_has_the_geometric_series() {
    let albedo = Vec3::new(0.5, 0.25, 0.75);
    let walls = Material { double_sided: true, ..glowing(Vec3::ONE, albedo) };
    let scene = Scene { things: vec![real(faceted_ball(1.0, 16), walls, at(0.0, 0.0, 0.0))], lights: vec![] };
    let camera = peephole(Vec3::new(0.3, 0.1, 0.0), Vec3::new(0.9, 0.0, 0.1), 1.0, 12);
    let film = picture(&trace(&scene, None), &camera, &deep(256));
    mixed_of(&film).is(Vec3::ONE / (Vec3::ONE - albedo), 1e-5, 5e-3);
}

/// A unit ball of ρ = ½ around a lamp of intensity π in all directions: E = π everywhere, direct L = ρ E/π = ½, all
/// bounces ½/(1 − ρ) = 1. (The test scene of pbrt.) Two half lamps, back to back.
#[test]
fn room_around_a_lamp_has_the_geometric_series() {
    use std::f32::consts::PI;
    let walls = Material { double_sided: true, ..lambert(Vec3::splat(0.5)) };
    let half =
        |direction| light(spot(PI, 90.0, 0.001), facing(Vec3::ZERO, direction), coshade_scene::World::Real);
    let scene = Scene {
        things: vec![real(faceted_ball(1.0, 64), walls, at(0.0, 0.0, 0.0))],
        lights: vec![half(Vec3::Z), half(-Vec3::Z)],
    };
    let camera = peephole(Vec3::new(0.5, 0.0, 0.2), Vec3::new(0.0, 0.9, 0.3), 0.4, 12);
    let film = picture(&trace(&scene, None), &camera, &deep(256));
    // Facets are up to 1 − cos(π/64) = 0.12 % nearer to the middle: E is up to 0.25 % higher, as a mean half of that.
    mixed_of(&film).is(Vec3::ONE, 2.5e-3, 5e-3);
}

/// Nothing reflects more than it gets.
#[test]
fn no_material_creates_light() {
    let materials = [
        Material::default(),
        Material { roughness: 0.2, ..Material::diffuse(Vec3::ONE) },
        Material { roughness: 0.0, ..Material::diffuse(Vec3::ONE) },
        Material::metal(Vec3::ONE, 0.3),
        Material::metal(Vec3::ONE, 0.0),
        Material::glass(1.5),
        Material { roughness: 0.4, ..Material::glass(1.5) },
        Material { thickness_m: 0.0, ..Material::glass(1.5) },
        Material { transmission: 0.5, ..Material::glass(1.3) },
    ];
    for (index, material) in materials.into_iter().enumerate() {
        let floor = real(square(3.0), lambert(Vec3::ONE), at(0.0, 0.0, -0.5));
        let ball = real(sphere(0.5, 32).unwrap(), material, at(0.0, 0.0, 0.0));
        let scene = trace(&Scene { things: vec![floor, ball], lights: Vec::new() }, white_sky());
        let camera = peephole(Vec3::new(3.0, 1.0, 2.0), Vec3::ZERO, 1.4, 10);
        let film = picture(&scene, &camera, &samples(64));
        for pixel in &film.pixels {
            let most = 1.0 + 5.0 * pixel.variance_mixed.map(f32::sqrt).max_element() + 1e-4;
            assert!(pixel.mixed.max_element() <= most, "material {index}: {pixel:?}");
            assert!(pixel.mixed.min_element() >= 0.0);
        }
        let mean = mixed_of(&film).mean;
        assert!(mean.min_element() > 0.8, "material {index} loses too much: {mean}");
    }
}
