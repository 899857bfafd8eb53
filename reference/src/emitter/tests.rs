use super::distribution::Discrete;
use super::*;
use coshade_scene::light::{Rectangle, Spot};
use coshade_scene::{Light as Described, LightKind};

fn disc_light(radius_m: f32) -> Described {
    let spot = Spot { radiant_intensity: Vec3::ONE, inner_rad: 0.5, outer_rad: 1.0, radius_m };
    Described { name: "lamp".into(), world: World::Real, pose: Pose::default(), kind: LightKind::Spot(spot) }
}

fn lights(described: Vec<Described>, environment: Option<Environment>) -> Result<Lights, LightError> {
    let scene = Scene { things: Vec::new(), lights: described };
    Lights::build(&scene, &Geometry::default(), environment, |_| None)
}

#[test]
fn lamps_are_seen_from_the_front_only() {
    let lights = lights(vec![disc_light(0.1)], None).unwrap();
    let towards = |z: f32| Ray::new(Vec3::new(0.05, 0.0, z), Vec3::new(0.0, 0.0, -z), 0);
    let hit = lights.hit_lamp(&towards(1.0)).unwrap();
    // L = I/(π r²) on the axis.
    assert!((hit.radiance.x - 1.0 / (PI * 0.01)).abs() < 1e-2 && (hit.t - 1.0).abs() < 1e-6);
    assert!(lights.hit_lamp(&towards(-1.0)).is_none());
    assert!(lights.hit_lamp(&Ray { t_max: 0.9, ..towards(1.0) }).is_none());
    let beside = Ray::new(Vec3::new(0.11, 0.0, 1.0), -Vec3::Z, 0);
    assert!(lights.hit_lamp(&beside).is_none());
}

/// What a ray finds has the same density as what a draw yields: or else the two would be weighted wrongly.
#[test]
fn drawn_and_hit_points_have_one_density() {
    let all = lights(vec![disc_light(0.3), disc_light(0.1)], Some(Environment::constant(Vec3::ONE).unwrap()))
        .unwrap();
    let from = Vec3::new(0.1, 0.2, 0.7);
    for index in 0..500 {
        let mut sampler = crate::random::Sampler::of_sequence(index, 3);
        let sample = all.sample(&Geometry::default(), from, sampler.next_1d(), sampler.next_2d()).unwrap();
        let ray = Ray::new(from, sample.wi, 0);
        if sample.target.is_none() {
            assert_eq!(sample.pdf, all.pdf_of_environment(sample.wi));
            continue;
        }
        // The discs coincide at the origin; the nearest is either, so compare with the one that was drawn.
        if let Some(hit) = all.hit_lamp(&ray).filter(|hit| hit.light == sample.light) {
            assert!(
                (hit.pdf / sample.pdf - 1.0).abs() < 1e-4 && hit.radiance.abs_diff_eq(sample.radiance, 1e-3)
            );
        }
    }
}

#[test]
fn lights_that_make_no_sense_are_named() {
    let bad = |change: &dyn Fn(&mut Spot)| {
        let mut light = disc_light(0.1);
        if let LightKind::Spot(spot) = &mut light.kind {
            change(spot);
        }
        lights(vec![light], None).unwrap_err().to_string()
    };
    assert!(bad(&|spot| spot.radius_m = 0.0).contains("'lamp': radius_m"));
    assert!(bad(&|spot| spot.radiant_intensity.x = f32::NAN).contains("radiant_intensity"));
    assert!(bad(&|spot| spot.inner_rad = 1.2).contains("cone"));
    assert!(bad(&|spot| spot.outer_rad = 2.0).contains("cone"));
    let rectangle = Rectangle { size_m: Vec2::new(1.0, 0.0), radiance: Vec3::ONE };
    let flat = Described { kind: LightKind::Rectangle(rectangle), ..disc_light(0.1) };
    assert!(lights(vec![flat], None).unwrap_err().to_string().contains("size_m"));
    let marker = Pose::Marker {
        family: "tag36h11".into(),
        id: 1,
        size_m: 0.1,
        marker_from_thing: Similarity::IDENTITY,
    };
    let lost = Described { pose: marker, ..disc_light(0.1) };
    assert_eq!(lights(vec![lost], None).unwrap_err(), LightError::UnknownPose { light: "lamp".into() });
}

#[test]
fn maps_that_are_no_radiance_are_refused() {
    let new =
        |layout, size, texels: Vec<Vec3>| Environment::new(layout, size, texels, Interpolation::Nearest, 0.0);
    let grey = |count| vec![Vec3::splat(0.5); count];
    assert!(new(Layout::Octahedral, [2, 1], grey(2)).unwrap_err().to_string().contains("square"));
    assert!(new(Layout::LatLong, [2, 2], grey(3)).is_err() && new(Layout::LatLong, [0, 0], grey(0)).is_err());
    let mut texels = grey(4);
    texels[3].y = -1.0;
    assert!(new(Layout::LatLong, [2, 2], texels).unwrap_err().to_string().contains("(1, 1)"));
    let black = Environment::constant(Vec3::ZERO).unwrap();
    assert!(black.sample(Vec2::splat(0.5)).is_none() && black.pdf_sr(Vec3::X) == 0.0);
    assert!(lights(Vec::new(), Some(black)).unwrap().is_empty());
}

/// A number is drawn as often as its weight says, exactly: the intervals of [0, 1) partition it.
#[test]
fn discrete_draws_follow_weights() {
    let discrete = Discrete::new([1.0, 0.0, 2.0, 5.0, 0.0]).unwrap();
    let mut counts = [0; 5];
    for step in 0..8000 {
        let choice = discrete.sample((step as f32 + 0.5) / 8000.0);
        counts[choice.index] += 1;
        assert_eq!(choice.probability, discrete.probability(choice.index));
        assert!((0.0..1.0).contains(&choice.rest));
    }
    assert_eq!(counts, [1000, 0, 2000, 5000, 0]);
    assert_eq!(discrete.sample(1.0 - f32::EPSILON / 2.0).index, 3, "never one of weight 0");
    assert!(
        Discrete::new([0.0, 0.0]).is_none()
            && Discrete::new([1.0, f64::NAN]).is_none()
            && Discrete::new([-1.0]).is_none()
    );
}

/// A lamp stuck on a real wall: the wall does not shade it, neither towards the room nor for its photons.
#[test]
fn a_lamp_on_a_wall_shines_into_the_room() {
    use crate::accel::{Accel, Sees};
    for distance_m in [0.0, 1.0, 100.0] {
        let pose = Pose::World(Similarity {
            rotation: glam::Quat::from_euler(glam::EulerRot::XYZ, 0.4, 0.9, 0.2),
            translation_m: Vec3::new(1.0, -0.7, 0.3) * distance_m,
            scale: 1.0,
        });
        let wall = coshade_scene::Thing {
            name: "wall".into(),
            world: World::Real,
            mesh: std::sync::Arc::new(coshade_scene::shape::plane(Vec2::splat(3.0)).unwrap()),
            materials: vec![std::sync::Arc::default()],
            pose: pose.clone(),
            hide_marker: false,
        };
        let scene =
            Scene { things: vec![wall], lights: vec![Described { pose: pose.clone(), ..disc_light(0.1) }] };
        let accel = Accel::build(&scene, |_| None).unwrap();
        let lights = Lights::build(&scene, accel.geometry(), None, |_| None).unwrap();
        for index in 0..2000 {
            let mut sampler = crate::random::Sampler::of_sequence(index, 8);
            let local = sample_cosine_hemisphere(sampler.next_2d()) + Vec3::Z * 0.1;
            let from = pose.resolve(|_| None).unwrap().transform_point(local);
            let (u_light, u2) = (sampler.next_1d(), sampler.next_2d());
            if let Some(sample) = lights.sample(accel.geometry(), from, u_light, u2) {
                assert!(
                    !accel.occluded(&sample.shadow_ray(from, 0), Sees::Everything),
                    "{distance_m} m away"
                );
            }
            let photon =
                lights.sample_emission(accel.geometry(), 0.5, sampler.next_2d(), sampler.next_2d()).unwrap();
            let ray = Ray::new(photon.origin, photon.direction, 0);
            assert!(!accel.occluded(&ray, Sees::Everything), "{distance_m} m away");
        }
    }
}

/// Of 64 points of a (0, 2)-sequence, each of two equal lamps gets 32, one in each of 4 × 8 parts of its area.
#[test]
fn points_on_each_of_several_lamps_are_stratified() {
    let lamp = || Described {
        kind: LightKind::Rectangle(Rectangle { size_m: Vec2::ONE, radiance: Vec3::ONE }),
        ..disc_light(1.0)
    };
    let all = lights(vec![lamp(), lamp()], None).unwrap();
    let mut seen = [[false; 32]; 2];
    for index in 0..64 {
        let pair = crate::random::Sampler::of_sequence(index, 5).next_2d();
        // The number in the middle is not needed for two.
        let sample = all.sample(&Geometry::default(), Vec3::Z, pair.x, Vec2::new(0.5, pair.y)).unwrap();
        let place = sample.target.unwrap().truncate() + 0.5;
        let part = (place.x * 4.0) as usize * 8 + (place.y * 8.0) as usize;
        assert!(!seen[sample.light as usize][part], "{index}");
        seen[sample.light as usize][part] = true;
    }
}
