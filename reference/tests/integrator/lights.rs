//! Direct light against closed forms.

use std::f64::consts::PI;

use coshade_reference::job::JobOptions;
use coshade_scene::{Scene, Thing, World};
use glam::{DVec3, Vec3};

use crate::studio::*;

fn direct(count: u32) -> JobOptions {
    JobOptions { settings: depth(1), ..samples(count) }
}

fn white_floor() -> Thing {
    real(square(1.0), lambert(Vec3::ONE), at(0.0, 0.0, 0.0))
}

/// Howell's catalogue C-11: two equal parallel squares, one side apart.
fn parallel_squares() -> f64 {
    // X = Y = 1.
    2.0 / PI
        * ((4.0_f64 / 3.0).sqrt().ln() + 2.0 * 2.0_f64.sqrt() * (1.0 / 2.0_f64.sqrt()).atan()
            - 2.0 * 1.0_f64.atan())
}

/// Howell's catalogue C-14: two squares at a right angle with a common edge.
fn perpendicular_squares() -> f64 {
    // H = W = 1.
    let sqrt2 = 2.0_f64.sqrt();
    (2.0 * 1.0_f64.atan() - sqrt2 * (1.0 / sqrt2).atan() + 0.25 * (4.0_f64 / 3.0 * 0.75 * 0.75).ln()) / PI
}

#[test]
fn the_catalogue_is_typed_in_right() {
    assert!((parallel_squares() - 0.199_825).abs() < 1e-5, "{}", parallel_squares());
    assert!((perpendicular_squares() - 0.200_044).abs() < 1e-5, "{}", perpendicular_squares());
}

/// A white square lit by a rectangle of radiance 1 has the mean radiance of the form factor between the two.
#[test]
fn form_factors_of_lamps() {
    // Lamps are not seen from behind: the eye looks through.
    let above = light(rectangle(1.0, 1.0, 1.0), facing(Vec3::Z, -Vec3::Z), World::Real);
    let beside = light(rectangle(1.0, 1.0, 1.0), facing(Vec3::new(-0.5, 0.0, 0.5), Vec3::X), World::Real);
    for (lamp, expected) in [(above, parallel_squares()), (beside, perpendicular_squares())] {
        let scene = trace(&Scene { things: vec![white_floor()], lights: vec![lamp] }, None);
        let film = picture(&scene, &peephole(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 1.0, 32), &direct(64));
        real_of(&film).is(Vec3::splat(expected as f32), 1e-5, 5e-3);
        assert!(
            film.pixels.iter().all(|pixel| pixel.difference == Vec3::ZERO && pixel.variance == Vec3::ZERO)
        );
    }
}

#[test]
fn form_factor_of_a_glowing_mesh() {
    let wall = real(square(1.0), glowing(Vec3::ONE, Vec3::ZERO), facing(Vec3::new(-0.5, 0.0, 0.5), Vec3::X));
    let scene = trace(&Scene { things: vec![white_floor(), wall], lights: vec![] }, None);
    let film = picture(&scene, &peephole(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 1.0, 32), &direct(64));
    real_of(&film).is(Vec3::splat(perpendicular_squares() as f32), 1e-4, 5e-3);
}

/// Irradiance at a point with normal +z of a polygon of radiance 1 above the horizon (Lambert 1760), corners clockwise
/// seen from below… the sign is dropped.
fn irradiance_of_polygon(point: DVec3, corners: &[DVec3]) -> f64 {
    let arms: Vec<DVec3> = corners.iter().map(|corner| (*corner - point).normalize()).collect();
    let edges = (0..arms.len()).map(|at| (arms[at], arms[(at + 1) % arms.len()]));
    edges.map(|(a, b)| a.dot(b).acos() * a.cross(b).normalize().z).sum::<f64>().abs() / 2.0
}

/// A rectangle lamp behind the straight edge of a virtual screen: the real world has the whole lamp, the mixed world the
/// part of it that the point sees past the edge, and the difference is the rest, with less noise than either.
#[test]
fn penumbra_of_a_virtual_screen() {
    let lamp = light(rectangle(0.4, 0.6, 10.0), facing(Vec3::Z, -Vec3::Z), World::Real);
    let screen = thing(block(2.0, 4.0, 1e-4), black(), at(-1.0, 0.0, 0.5), World::Virtual);
    let scene = trace(&Scene { things: vec![white_floor(), screen], lights: vec![lamp] }, None);
    for x in [-0.25_f64, -0.1, 0.0, 0.13, 0.25] {
        let point = Vec3::new(x as f32, 0.0, 0.0);
        let film = picture(&scene, &peephole(Vec3::new(1.0, 0.2, 0.35), point, 1e-3, 16), &direct(64));
        let part = |from: f64| {
            let corner = |x, y| DVec3::new(x, y, 1.0);
            let corners = [corner(from, -0.3), corner(0.2, -0.3), corner(0.2, 0.3), corner(from, 0.3)];
            irradiance_of_polygon(DVec3::new(x, 0.0, 0.0), &corners) * 10.0 / PI
        };
        // From (x, 0) past (0, ½) to height 1.
        let seen = if x > -0.2 { part((-x).max(-0.2)) } else { 0.0 };
        let (seen, whole) = (Vec3::splat(seen as f32), Vec3::splat(part(-0.2) as f32));
        real_of(&film).is(whole, 1e-3, 1e-2);
        // The screen is 0.1 mm thick, the spot 1 mm wide: of 0.4 m of lamp they shift 2 · 0.3 mm.
        let Estimate { mean, error } = mixed_of(&film);
        assert!((mean - seen).abs().cmple(3.0 * error + 2e-3 * whole).all(), "{x}: {mean} ± {error}, {seen}");
        let Estimate { mean, error } = difference_of(&film);
        let hidden = seen - whole;
        assert!((mean - hidden).abs().cmple(3.0 * error + 2e-3 * whole).all(), "{x}: {mean}, {hidden}");
    }
}

/// From afar discs of any size are the spot they stand for: E = I cosθ/d².
#[test]
fn discs_of_any_size_have_one_far_field() {
    let floor = || real(square(1.0), lambert(Vec3::ONE), at(0.0, 0.0, 0.0));
    for radius_m in [0.0005_f32, 0.005, 0.05] {
        let lamp = light(spot(20.0, 40.0, radius_m), facing(Vec3::new(3.0, 0.0, 4.0), -Vec3::Z), World::Real);
        let scene = trace(&Scene { things: vec![floor()], lights: vec![lamp] }, None);
        let camera = peephole(Vec3::new(0.0, 1.0, 1.0), Vec3::ZERO, 1e-3, 8);
        let film = picture(&scene, &camera, &direct(256));
        // 36.9° off the lamp's axis, within its cone; (r/d)² = 1e-4 for the largest.
        let expected = 20.0 * 0.8 / 25.0 / std::f32::consts::PI;
        real_of(&film).is(Vec3::splat(expected), 4e-4, 2e-3);
    }
}

/// A virtual lamp lights the mixed world only, on real things too.
#[test]
fn virtual_lamps_are_not_in_the_real_world() {
    let lamp = |world| light(rectangle(1.0, 1.0, 1.0), facing(Vec3::Z, -Vec3::Z), world);
    let lights = vec![lamp(World::Real), lamp(World::Virtual)];
    let scene = trace(&Scene { things: vec![white_floor()], lights }, None);
    let film = picture(&scene, &peephole(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 1.0, 32), &direct(128));
    let one = Vec3::splat(parallel_squares() as f32);
    real_of(&film).is(one, 1e-5, 5e-3);
    mixed_of(&film).is(2.0 * one, 1e-5, 5e-3);
    difference_of(&film).is(one, 1e-5, 5e-3);
}
