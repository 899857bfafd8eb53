//! The same light found in other ways: eye paths against photons, classes against their sum.

use std::sync::atomic::AtomicBool;

use coshade_reference::camera::Camera;
use coshade_reference::differential::Split;
use coshade_reference::emitter::{Environment, Interpolation, Layout};
use coshade_reference::integrator::{Classes, EyePath, Method, Settings, TraceScene};
use coshade_reference::job::JobOptions;
use coshade_reference::photon::{PhotonMap, PhotonPaths, trace_photons};
use coshade_reference::random::Sampler;
use coshade_scene::{Material, Scene, World};
use glam::Vec3;

use crate::studio::*;

fn with_method(method: Method, max_depth: u32) -> Settings {
    Settings { method, max_depth, ..Settings::default() }
}

/// A real room corner in real light of every kind, a virtual box with a glowing lid and a virtual lamp.
fn diffuse_scene() -> TraceScene {
    let box_at = |x, y| at(x, y, 0.2);
    let things = vec![
        real(square(2.0), lambert(Vec3::new(0.7, 0.6, 0.5)), at(0.0, 0.0, 0.0)),
        real(square(2.0), lambert(Vec3::new(0.3, 0.6, 0.7)), facing(Vec3::new(-1.0, 0.0, 1.0), Vec3::X)),
        real(
            square(0.3),
            glowing(Vec3::splat(3.0), Vec3::splat(0.2)),
            facing(Vec3::new(0.0, -0.9, 0.8), Vec3::Y),
        ),
        thing(block(0.4, 0.4, 0.4), lambert(Vec3::new(0.2, 0.8, 0.3)), box_at(-0.5, 0.0), World::Virtual),
        thing(square(0.2), glowing(Vec3::splat(2.0), Vec3::ZERO), at(-0.5, 0.0, 0.45), World::Virtual),
    ];
    let lights = vec![
        light(
            spot(3.0, 40.0, 0.02),
            facing(Vec3::new(0.2, 0.9, 1.5), Vec3::new(-0.7, -0.9, -1.4)),
            World::Real,
        ),
        light(rectangle(0.3, 0.3, 3.0), facing(Vec3::new(0.5, 0.8, 1.0), -Vec3::Z), World::Virtual),
    ];
    trace(&Scene { things, lights }, two_skies(Vec3::splat(0.5), Vec3::splat(0.1)))
}

/// Radiance of all targets in both worlds, from photons of all paths gathered at the first surface.
fn by_photons(scene: &TraceScene, cameras: &[Camera], seed: u32) -> Vec<Split> {
    const PASSES: u32 = 6;
    const RAYS: u32 = 4;
    // E changes over 30 cm or more: the kernel's bias, r²/8 ∇²E, is below 0.5 %.
    const RADIUS_M: f32 = 0.06;
    let settings = with_method(Method::Photons, 6);
    let mut sums = vec![Split::default(); cameras.len()];
    for pass in 0..PASSES {
        let stop = AtomicBool::new(false);
        let photons = trace_photons(scene, &settings, PhotonPaths::All, 60_000, [seed, pass], &stop).unwrap();
        let map = PhotonMap::new(&photons, RADIUS_M);
        for (camera, sum) in cameras.iter().zip(&mut sums) {
            for sample in pass * RAYS..(pass + 1) * RAYS {
                let sampler = Sampler::new([0, 0], sample, seed);
                let ray = camera.ray([0, 0], sampler.clone().next_2d()).unwrap();
                let found = EyePath::trace(scene, settings, Some(&map), &ray, sampler).radiance;
                let share = 1.0 / (PASSES * RAYS) as f32;
                sum.shared += found.shared * share;
                sum.real_only += found.real_only * share;
                sum.mixed_only += found.mixed_only * share;
            }
        }
    }
    sums
}

/// Light tracing knows nothing of the splitting of eye paths, and eye paths nothing of the photons' bits; both worlds and
/// the difference must come out the same, in light, in virtual shadow, on the wall and on the virtual box.
#[test]
fn photons_of_all_paths_agree_with_eye_paths_in_both_worlds() {
    let scene = diffuse_scene();
    let eye = Vec3::new(1.5, 0.6, 0.9);
    let targets = [
        ("floor in the light", Vec3::new(0.3, 0.2, 0.0)),
        ("floor in the box's shadow", Vec3::new(-0.5, -0.4, 0.0)),
        ("wall", Vec3::new(-1.0, -0.5, 0.4)),
        ("the box", Vec3::new(-0.3, 0.0, 0.2)),
    ];
    let cameras = targets.map(|(_, target)| peephole(eye, target, 0.02, 1));
    let found: Vec<Vec<Split>> = (1..=8).map(|seed| by_photons(&scene, &cameras, seed)).collect();
    for (at, (name, target)) in targets.into_iter().enumerate() {
        let paths = JobOptions { settings: with_method(Method::Paths, 6), ..samples(4096) };
        let film = picture(&scene, &peephole(eye, target, 0.02, 4), &paths);
        let photons = |value: fn(&Split) -> Vec3| over_seeds(8, |seed| value(&found[seed as usize - 1][at]));
        println!("{name}");
        photons(Split::real).agrees(&real_of(&film), 0.05);
        photons(Split::mixed).agrees(&mixed_of(&film), 0.05);
        photons(Split::difference).agrees(&difference_of(&film), 0.15);
    }
}

/// A real ball of glass and a virtual one on a floor, in a sky and under a lamp large enough to be hit by chance.
fn glass_scene() -> (Scene, Option<Environment>) {
    let ball = |x, world| thing(faceted_ball(0.3, 24), Material::glass(1.5), at(x, 0.0, 0.35), world);
    let mirror = Material::metal(Vec3::splat(0.9), 0.0);
    let things = vec![
        real(square(3.0), lambert(Vec3::splat(0.6)), at(0.0, 0.0, 0.0)),
        real(square(1.0), mirror, facing(Vec3::new(0.0, -0.8, 0.5), Vec3::Y)),
        ball(-0.35, World::Real),
        ball(0.35, World::Virtual),
    ];
    let lamp = light(rectangle(1.0, 1.0, 2.0), facing(Vec3::new(0.2, 0.0, 2.0), -Vec3::Z), World::Real);
    let texels = vec![Vec3::splat(0.5), Vec3::splat(0.2), Vec3::splat(0.3), Vec3::splat(0.1)];
    let sky = Environment::new(Layout::LatLong, [1, 4], texels, Interpolation::Bilinear, 0.0).unwrap();
    (Scene { things, lights: vec![lamp] }, Some(sky))
}

const CLASSES: [Classes; 4] = [
    Classes { seen: true, ..Classes::NONE },
    Classes { lit: true, ..Classes::NONE },
    Classes { environment_caustics: true, ..Classes::NONE },
    Classes { lamp_caustics: true, ..Classes::NONE },
];

/// Each class alone: together they are the whole, sample by sample, and each is there.
#[test]
fn classes_sum_to_the_whole() {
    let (scene, sky) = glass_scene();
    let scene = trace(&scene, sky);
    let camera = peephole(Vec3::new(0.0, 2.5, 1.5), Vec3::new(0.0, 0.0, 0.3), 1.6, 24);
    for method in [Method::Paths, Method::PathsAndPhotons] {
        let options = |classes| JobOptions {
            settings: Settings { classes, ..with_method(method, 16) },
            photons_per_pass: Some(5000),
            photon_radius_m: Some(0.1),
            ..samples(8)
        };
        let whole = picture(&scene, &camera, &options(Classes::ALL));
        let parts = CLASSES.map(|classes| picture(&scene, &camera, &options(classes)));
        for (at, pixel) in whole.pixels.iter().enumerate() {
            let sum = |of: fn(&coshade_reference::film::FilmPixel) -> Vec3| -> Vec3 {
                parts.iter().map(|part| of(&part.pixels[at])).sum()
            };
            assert!((sum(|pixel| pixel.real) - pixel.real).length() < 1e-4 * (1.0 + pixel.real.length()));
            assert!((sum(|pixel| pixel.mixed) - pixel.mixed).length() < 1e-4 * (1.0 + pixel.mixed.length()));
        }
        for part in &parts {
            assert!(mixed_of(part).mean.x > 1e-3, "{method:?}: a class is empty");
        }
    }
}

/// Photons find the same caustics as eye paths that hit the lamp by chance: no path is counted twice or lost.
#[test]
fn caustics_of_photons_agree_with_those_of_eye_paths() {
    let (scene, sky) = glass_scene();
    let scene = trace(&scene, sky);
    let eye = Vec3::new(0.0, 2.5, 1.5);
    // Under the real ball, and under the virtual one, where the real world has light by the real ball and the mirror only.
    for (x, y, precision) in [(-0.35, 0.1, 0.05), (0.35, 0.1, 0.15)] {
        println!("{x} {y}");
        let camera = peephole(eye, Vec3::new(x, y, 0.0), 0.04, 4);
        let classes = Classes { lamp_caustics: true, ..Classes::NONE };
        let paths = Settings { classes, ..with_method(Method::Paths, 12) };
        let film = picture(&scene, &camera, &JobOptions { settings: paths, ..samples(8192) });
        let photons = |seed| JobOptions {
            settings: Settings { classes, ..with_method(Method::PathsAndPhotons, 12) },
            photons_per_pass: Some(60_000),
            photon_radius_m: Some(0.02),
            seed,
            ..samples(8)
        };
        let films: Vec<_> = (1..=8).map(|seed| picture(&scene, &camera, &photons(seed))).collect();
        over_seeds(8, |seed| real_of(&films[seed as usize - 1]).mean).agrees(&real_of(&film), precision);
        over_seeds(8, |seed| mixed_of(&films[seed as usize - 1]).mean).agrees(&mixed_of(&film), 0.05);
    }
}

/// 0 shows lights alone; every bounce adds light.
#[test]
fn depth_counts_scattering_events() {
    let (scene, sky) = glass_scene();
    let scene = trace(&scene, sky);
    let camera = peephole(Vec3::new(0.0, 2.5, 1.5), Vec3::new(0.0, 0.0, 0.3), 1.6, 8);
    let floor = peephole(Vec3::new(0.0, 2.5, 1.5), Vec3::new(0.0, 0.6, 0.0), 0.1, 8);
    let dark = picture(&scene, &floor, &JobOptions { settings: depth(0), ..samples(4) });
    assert!(dark.pixels.iter().all(|pixel| pixel.mixed == Vec3::ZERO && pixel.depth_m > 0.0));
    let mut last = 0.0;
    for max_depth in [1, 2, 4, 16] {
        let options = JobOptions { settings: depth(max_depth), photons_per_pass: Some(1000), ..samples(16) };
        let mean = mixed_of(&picture(&scene, &camera, &options)).mean.x;
        assert!(mean > last, "{max_depth}: {mean} after {last}");
        last = mean;
    }
}

/// Glass, mirrors and inner reflections: each world is what a picture of it alone shows, seen by eye paths.
#[test]
fn worlds_of_glass_are_what_they_would_be_alone() {
    let (scene, sky) = glass_scene();
    let tracers =
        [scene.clone(), all_real(&scene), only_real(&scene)].map(|scene| trace(&scene, sky.clone()));
    // On the floor in the virtual caustic, through the virtual ball, through the real ball, in the mirror.
    let targets = [
        Vec3::new(0.35, 0.1, 0.0),
        Vec3::new(0.35, 0.0, 0.4),
        Vec3::new(-0.35, 0.0, 0.4),
        Vec3::new(0.0, -0.8, 0.7),
    ];
    for target in targets {
        let camera = peephole(Vec3::new(0.0, 2.5, 1.5), target, 0.06, 8);
        let film = |tracer, seed| {
            let settings = with_method(Method::Paths, 12);
            picture(tracer, &camera, &JobOptions { settings, seed, ..samples(512) })
        };
        let [both, mixed, real] = [(0, 0), (1, 1), (2, 2)].map(|(which, seed)| film(&tracers[which], seed));
        mixed_of(&both).agrees(&real_of(&mixed), 0.03);
        real_of(&both).agrees(&real_of(&real), 0.03);
        assert!(difference_of(&mixed).mean == Vec3::ZERO);
    }
}
