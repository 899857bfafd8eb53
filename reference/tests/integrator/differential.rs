//! Two worlds: each is what it would be alone, and their difference is what the virtual things do.

use coshade_reference::film::Film;
use coshade_reference::integrator::{Classes, Method, Settings, TraceScene};
use coshade_reference::job::JobOptions;
use coshade_scene::shape::sphere;
use coshade_scene::{AlphaMode, Light, LightKind, Material, Scene, Thing, World};
use glam::Vec3;

use crate::studio::*;

fn spot_light(world: World) -> Light {
    let position = Vec3::new(1.0, 0.0, 1.2);
    let mut lamp =
        light(spot(6.0, 35.0, 0.01), facing(position, Vec3::new(-0.15, 0.0, 0.1) - position), world);
    // Nothing else in this scene is red, green and blue in these shares.
    if let LightKind::Spot(spot) = &mut lamp.kind {
        spot.radiant_intensity = Vec3::new(6.0, 5.0, 4.0);
    }
    lamp
}

/// RSMR's fig. 6: a real desk under a real spot, a virtual cube on it, and a real wall behind.
fn desk(cube: Vec3) -> Scene {
    let things = vec![
        real(square(2.0), lambert(Vec3::new(0.8, 0.4, 0.2)), at(0.0, 0.0, 0.0)),
        real(square(2.0), lambert(Vec3::splat(0.7)), facing(Vec3::new(-0.6, 0.0, 1.0), Vec3::X)),
        thing(block(0.3, 0.3, 0.3), lambert(cube), at(0.0, 0.0, 0.151), World::Virtual),
    ];
    Scene { things, lights: vec![spot_light(World::Real)] }
}

fn look(scene: &TraceScene, target: Vec3, max_depth: u32, count: u32) -> Film {
    let camera = peephole(Vec3::new(0.6, 1.6, 1.0), target, 0.03, 12);
    picture(scene, &camera, &JobOptions { settings: depth(max_depth), ..samples(count) })
}

/// In the cube's shadow on the desk.
const SHADOW: Vec3 = Vec3::new(-0.25, 0.0, 0.0);
/// On the wall, where it sees the shadow, above the cube's own shadow.
const WALL: Vec3 = Vec3::new(-0.6, 0.0, 0.9);
/// On the lit desk before the cube.
const BEFORE: Vec3 = Vec3::new(0.25, 0.1, 0.0);
/// On the cube's side that the spot does not see, but the eye does.
const SIDE: Vec3 = Vec3::new(0.0, 0.15, 0.1);

/// Case 3, the shadow: direct light in the real world only, of the size I cosθ ρ/(π d²).
#[test]
fn case_3_shadow() {
    let scene = trace(&desk(Vec3::ZERO), None);
    let film = look(&scene, SHADOW, 1, 64);
    let to_lamp = Vec3::new(1.0, 0.0, 1.2) - SHADOW;
    let cosine = to_lamp.z / to_lamp.length();
    let expected = Vec3::new(6.0, 5.0, 4.0) * Vec3::new(0.8, 0.4, 0.2) * cosine
        / (std::f32::consts::PI * to_lamp.length_squared());
    // The view is 3 cm wide; radiance changes by about a percent per centimetre, linearly: the mean stays.
    real_of(&film).is(expected, 5e-3, 5e-3);
    assert!(film.pixels.iter().all(|pixel| pixel.mixed == Vec3::ZERO));
    difference_of(&film).is(-expected, 5e-3, 5e-3);
}

/// Case 1, desk → cube: on the virtual cube's dark side there is light of the desk's colour, in the mixed world only.
#[test]
fn case_1_desk_bleeds_to_cube() {
    let scene = trace(&desk(Vec3::splat(0.5)), None);
    let direct = look(&scene, SIDE, 1, 16);
    assert!(direct.pixels.iter().all(|pixel| pixel.mixed == Vec3::ZERO && pixel.coverage == 1.0));
    let film = look(&scene, SIDE, 2, 256);
    let Estimate { mean, error } = mixed_of(&film);
    assert!((mean - 5.0 * error).min_element() > 0.0, "{mean} ± {error}");
    // The desk's red under the lamp's: (6·0.8)/(4·0.2) = 6 if all light came from the desk; the wall's part has 1.5.
    assert!((1.5..6.0).contains(&(mean.x / mean.z)), "{mean}");
    // The real world is what lies behind: the desk, at depth 2 as seen without the cube.
    let alone = look(&trace(&only_real(&desk(Vec3::ZERO)), None), SIDE, 2, 256);
    real_of(&film).agrees(&real_of(&alone), 0.01);
}

/// Case 2, cube → desk: a green cube brightens the desk before it, in green, in the mixed world only.
#[test]
fn case_2_cube_bleeds_to_desk() {
    let scene = trace(&desk(Vec3::new(0.0, 0.9, 0.0)), None);
    let direct = look(&scene, BEFORE, 1, 16);
    assert!(direct.pixels.iter().all(|pixel| pixel.difference == Vec3::ZERO), "it is not shadowed");
    let film = look(&scene, BEFORE, 2, 512);
    let black = look(&trace(&desk(Vec3::ZERO), None), BEFORE, 2, 512);
    let (green, dark) = (difference_of(&film), difference_of(&black));
    let bleeding = green.mean - dark.mean;
    let error = (green.error * green.error + dark.error * dark.error).map(f32::sqrt);
    assert!(bleeding.y > 5.0 * error.y, "{bleeding} ± {error}");
    // The same random numbers meet the same cube: what it does not reflect is alike.
    assert!(bleeding.x.abs() < 1e-6 && bleeding.z.abs() < 1e-6, "{bleeding}");
    // The cube also hides a part of the wall.
    assert!(dark.mean.max_element() < 0.0);
}

/// Case 4: light that bounced off the desk where the cube's shadow is now, is missing on the wall. A black cube, so that
/// it sends nothing itself.
#[test]
fn case_4_bounces_of_the_blocked_light_are_cancelled() {
    let scene = trace(&desk(Vec3::ZERO), None);
    let direct = look(&scene, WALL, 1, 16);
    assert!(direct.pixels.iter().all(|pixel| pixel.difference == Vec3::ZERO), "its own light is not blocked");
    let film = look(&scene, WALL, 2, 512);
    let Estimate { mean, error } = difference_of(&film);
    assert!((mean + 5.0 * error).max_element() < 0.0, "{mean} ± {error}");
    // Of the desk's colour: (6·0.8)/(4·0.2).
    assert!((mean.x / mean.z - 6.0).abs() < 1e-3, "{mean}");
    // RSMR's first bounce: the patch that the cube shades or hides, seen from the wall.
    let expected = missing_bounce(WALL);
    let off = (mean.x - expected).abs();
    assert!(off < 3.0 * error.x + 0.02 * expected.abs(), "{mean} ± {error}, expected {expected}");
}

/// `−∫ ρ E/π · cosθ cosθ'/d² dA · ρ_wall/π` over the points of the desk that the lamp or the wall's point sees without the
/// cube but not with it; red. By sums over a grid of 2 mm.
fn missing_bounce(wall: Vec3) -> f32 {
    let lamp = Vec3::new(1.0, 0.0, 1.2);
    let axis = (Vec3::new(-0.15, 0.0, 0.1) - lamp).normalize_or(Vec3::X);
    let step = 0.002_f32;
    let mut sum = 0.0_f64;
    for row in 0..1000 {
        for column in 0..1000 {
            let point = Vec3::new(-1.0 + (column as f32 + 0.5) * step, -1.0 + (row as f32 + 0.5) * step, 0.0);
            if point.x < -0.6 {
                continue;
            }
            let (to_lamp, to_wall) = (lamp - point, wall - point);
            let lit = (-to_lamp).dot(axis) / to_lamp.length() > 35.0_f32.to_radians().cos();
            if !lit || !(cuts_cube(point, lamp) || cuts_cube(point, wall)) {
                continue;
            }
            let irradiance = 6.0 * to_lamp.z / to_lamp.length().powi(3);
            let form = to_wall.z * (-to_wall).dot(Vec3::X).max(0.0) / to_wall.length().powi(4);
            sum += f64::from(irradiance * 0.8 / std::f32::consts::PI * form * step * step);
        }
    }
    -(sum as f32) * 0.7 / std::f32::consts::PI
}

/// Slab test of a segment against the cube.
fn cuts_cube(from: Vec3, to: Vec3) -> bool {
    let (low, high) = (Vec3::new(-0.15, -0.15, 0.001), Vec3::new(0.15, 0.15, 0.301));
    let direction = to - from;
    let (a, b) = ((low - from) / direction, (high - from) / direction);
    a.min(b).max_element().max(0.0) < a.max(b).min_element().min(1.0)
}

/// Both worlds, depth by depth and anywhere, are what independent pictures of each alone show.
#[test]
fn each_world_is_what_it_would_be_alone() {
    let scene = desk(Vec3::new(0.2, 0.8, 0.3));
    let (both, mixed, real) =
        (trace(&scene, None), trace(&all_real(&scene), None), trace(&only_real(&scene), None));
    for max_depth in [1, 2, 6] {
        for target in [SHADOW, WALL, BEFORE, SIDE] {
            let film = look(&both, target, max_depth, 128);
            let alone = |scene: &TraceScene| {
                let camera = peephole(Vec3::new(0.6, 1.6, 1.0), target, 0.03, 12);
                let options = JobOptions { seed: 5, settings: depth(max_depth), ..samples(128) };
                real_of(&picture(scene, &camera, &options))
            };
            for (found, expected) in [(mixed_of(&film), alone(&mixed)), (real_of(&film), alone(&real))] {
                if expected.mean == Vec3::ZERO {
                    assert_eq!(found.mean, Vec3::ZERO);
                } else {
                    found.agrees(&expected, 0.05);
                }
            }
        }
    }
}

/// Common random numbers: where a virtual thing hardly matters, the difference has far less noise than the worlds.
#[test]
fn the_difference_has_less_noise_than_its_terms() {
    let film = look(&trace(&desk(Vec3::splat(0.5)), None), Vec3::new(0.2, 0.6, 0.0), 4, 64);
    let (difference, mixed, real) = (difference_of(&film), mixed_of(&film), real_of(&film));
    assert!(difference.error.x < 0.6 * (mixed.error.x.powi(2) + real.error.x.powi(2)).sqrt());
    for pixel in &film.pixels {
        assert!((pixel.mixed - pixel.real - pixel.difference).abs().max_element() < 1e-5);
    }
}

#[test]
fn without_virtual_things_there_is_no_difference() {
    let mut scene = all_real(&desk(Vec3::splat(0.5)));
    scene.things.push(real(sphere(0.1, 16).unwrap(), Material::glass(1.5), at(0.3, 0.3, 0.3)));
    let options = JobOptions { photons_per_pass: Some(2000), ..samples(16) };
    let camera = peephole(Vec3::new(0.6, 1.6, 1.0), Vec3::new(0.0, 0.1, 0.1), 1.5, 24);
    let film = picture(&trace(&scene, white_sky()), &camera, &options);
    for pixel in &film.pixels {
        assert_eq!((pixel.difference, pixel.variance), (Vec3::ZERO, Vec3::ZERO));
        assert_eq!((pixel.real, pixel.coverage), (pixel.mixed, 0.0));
    }
    assert!(real_of(&film).mean.x > 0.1);
}

/// THESIS fig. 7.4a: the caustic of a real glass under a real lamp, with a virtual board held between the glass and the
/// floor. The real world keeps it, the mixed one loses it, and the difference cancels it in the camera image.
#[test]
fn real_caustic_behind_a_virtual_board_is_cancelled() {
    let board = |z| thing(block(0.5, 0.5, 0.01), black(), at(0.0, 0.0, z), World::Virtual);
    let scene = |board: Option<Thing>| {
        let mut things = vec![
            real(square(2.0), lambert(Vec3::splat(0.5)), at(0.0, 0.0, 0.0)),
            real(sphere(0.1, 64).unwrap(), Material::glass(1.5), at(0.0, 0.0, 0.4)),
        ];
        things.extend(board);
        let lamp_at = facing(Vec3::new(0.0, 0.0, 2.0), -Vec3::Z);
        let lights = vec![light(spot(10.0, 4.0, 0.005), lamp_at, World::Real)];
        trace(&Scene { things, lights }, None)
    };
    let classes = Classes { lamp_caustics: true, ..Classes::NONE };
    let options = JobOptions {
        settings: Settings { classes, method: Method::PathsAndPhotons, ..depth(8) },
        photons_per_pass: Some(2000),
        photon_radius_m: Some(0.03),
        ..samples(16)
    };
    let camera = peephole(Vec3::new(0.6, 0.0, 0.1), Vec3::ZERO, 0.02, 4);
    let free = picture(&scene(None), &camera, &options);
    assert!(real_of(&free).mean.x > 0.1, "there is a caustic: {}", real_of(&free).mean);
    // Between glass and floor, and between lamp and glass.
    for height_m in [0.2, 1.0] {
        let blocked = picture(&scene(Some(board(height_m))), &camera, &options);
        for (pixel, was) in blocked.pixels.iter().zip(&free.pixels) {
            assert_eq!(pixel.real, was.real, "the same photons");
            assert_eq!(pixel.mixed, Vec3::ZERO);
            assert_eq!(pixel.difference, -was.real);
        }
    }
}

/// A virtual glass throws a caustic and blocks the light it takes; a copy of index 1 gives back exactly what it takes.
#[test]
fn virtual_glass_of_index_one_changes_nothing_on_the_mean() {
    let ball = thing(faceted_ball(0.3, 16), Material::glass(1.0), at(0.0, 0.0, 0.5), World::Virtual);
    let floor = real(square(2.0), lambert(Vec3::splat(0.5)), at(0.0, 0.0, 0.0));
    let lamp = light(spot(10.0, 15.0, 0.01), facing(Vec3::new(0.0, 0.0, 2.0), -Vec3::Z), World::Real);
    let scene = trace(&Scene { things: vec![ball, floor], lights: vec![lamp] }, None);
    let camera = peephole(Vec3::new(0.8, 0.0, 0.15), Vec3::ZERO, 0.04, 2);
    let difference = over_seeds(8, |seed| {
        let options = JobOptions {
            seed,
            photons_per_pass: Some(20_000),
            photon_radius_m: Some(0.02),
            settings: depth(4),
            ..samples(4)
        };
        let film = picture(&scene, &camera, &options);
        assert!(real_of(&film).mean.x > 0.1);
        difference_of(&film).mean / real_of(&film).mean
    });
    // Light of the real world comes by light sampling, that of the mixed one by photons: their noise does not cancel.
    assert!(difference.mean.abs().cmple(3.0 * difference.error).all(), "{difference:?}");
    assert!(difference.error.x < 0.02, "{difference:?}");
}

/// A virtual pane that is a quarter there: so it is in coverage and in the mixed world, while the real world has what is
/// behind it.
#[test]
fn blended_virtual_things_cover_their_share() {
    let color = Vec3::new(4.0, 0.0, 1.0);
    let pane = Material {
        alpha_mode: AlphaMode::Blend,
        base_color: Vec3::ZERO.extend(0.25),
        ..glowing(color, Vec3::ZERO)
    };
    let things = vec![
        real(square(2.0), glowing(Vec3::splat(0.5), Vec3::ZERO), at(0.0, 0.0, 0.0)),
        thing(square(1.0), pane, at(0.0, 0.0, 0.5), World::Virtual),
    ];
    let scene = trace(&Scene { things, lights: Vec::new() }, None);
    let film = picture(&scene, &peephole(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, 0.2, 16), &samples(256));
    assert!(film.pixels.iter().all(|pixel| pixel.real == Vec3::splat(0.5)));
    mixed_of(&film).is(0.25 * color + 0.75 * Vec3::splat(0.5), 1e-5, 0.01);
    let coverage = film.pixels.iter().map(|pixel| pixel.coverage).sum::<f32>() / film.pixels.len() as f32;
    // 65536 samples: standard deviation 0.0017.
    assert!((coverage - 0.25).abs() < 0.0051, "{coverage}");
}
