//! Maps of tags whose true poses are known.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_tracker::map::{MapError, MapSettings, TagMap, View, map_tags};
use coshade_tracker::{Family, TagId, TagObservation, UNIT_CORNERS, lie};
use nalgebra::{Isometry3, Point3, Rotation3, SMatrix, Translation3, UnitQuaternion, Vector2, Vector3};

const SIZE_M: f64 = 0.2;
const SIGMA_PX: f64 = 0.2;
const TAGS: u32 = 20;
const VIEWS: u32 = 60;

/// Normal numbers, the same ones in each run (Box and Muller from a linear congruence).
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

fn tag(id: u32) -> TagId {
    TagId { family: Family::Tag36h11, id }
}

/// A frame at `place` whose z axis points along `z` and whose y axis is as much up (the room's z) as can be.
fn facing(place: Vector3<f64>, z: Vector3<f64>) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::face_towards(&z, &Vector3::z()));
    Isometry3::from_parts(Translation3::from(place), rotation)
}

/// Tags around the walls of a round room of 3 m radius, at different heights, a bit off upright.
fn room_from_tag(id: u32) -> Isometry3<f64> {
    let angle = std::f64::consts::TAU * f64::from(id) / f64::from(TAGS);
    let outwards = Vector3::new(angle.cos(), angle.sin(), 0.0);
    let place = outwards * 3.0 + Vector3::z() * (0.5 * (1.7 * f64::from(id)).sin());
    let tilt = Vector3::new(0.05, -0.1, 0.07) * (2.3 * f64::from(id)).cos();
    facing(place, -outwards) * Isometry3::rotation(tilt)
}

/// Someone walks around near the middle and looks at the walls.
fn camera_from_room(view: u32) -> Isometry3<f64> {
    let angle = std::f64::consts::TAU * (f64::from(view) + 0.3) / f64::from(VIEWS);
    let outwards = Vector3::new(angle.cos(), angle.sin(), 0.2 * (1.3 * f64::from(view)).sin());
    let place = Vector3::new((angle * 2.0).sin(), (angle * 3.0).cos(), 0.3 * (angle * 5.0).sin());
    // The camera's y axis points down.
    let camera = facing(place, outwards) * Isometry3::rotation(Vector3::z() * std::f64::consts::PI);
    camera.inverse()
}

fn pinhole() -> CameraModel {
    CameraModel::from_params(ModelKind::Pinhole, &[600.0, 600.0, 479.5, 359.5]).unwrap()
}

fn observed(
    lens: &CameraModel,
    camera_from_tag: &Isometry3<f64>,
    size_m: f64,
    id: u32,
    noise: &mut Normal,
) -> Option<TagObservation> {
    // Seen from its front, and not along its plane.
    let sight = camera_from_tag.translation.vector.normalize();
    if -(camera_from_tag.rotation * Vector3::z()).dot(&sight) < 0.2 {
        return None;
    }
    let mut corners_px = [Vector2::zeros(); 4];
    for (px, [x, y]) in corners_px.iter_mut().zip(UNIT_CORNERS) {
        let corner = camera_from_tag * Point3::new(x * size_m, y * size_m, 0.0);
        *px = lens.project(&corner.coords)?;
        if !((0.0..=959.0).contains(&px.x) && (0.0..=719.0).contains(&px.y)) {
            return None;
        }
        *px += Vector2::new(noise.next(), noise.next()) * SIGMA_PX;
    }
    let covariance_px2 = SMatrix::identity() * (SIGMA_PX * SIGMA_PX);
    Some(TagObservation { tag: tag(id), corners_px, covariance_px2 })
}

fn views_of(lens: &CameraModel, size_m: impl Fn(u32) -> f64, seed: u64) -> Vec<View> {
    let mut noise = Normal(seed);
    let mut view = |number: u32| {
        let camera = camera_from_room(number);
        let observations = (0..TAGS)
            .filter_map(|id| observed(lens, &(camera * room_from_tag(id)), size_m(id), id, &mut noise))
            .collect();
        View { number: number.into(), observations }
    };
    (0..VIEWS).map(&mut view).collect()
}

fn settings() -> MapSettings {
    MapSettings { size_m: Some(SIZE_M), ..MapSettings::default() }
}

fn map(views: &[View], lens: &CameraModel, settings: &MapSettings) -> Result<TagMap, MapError> {
    map_tags(views, lens, settings, &|| true)
}

/// Mean of χ²/6 of all tags but the origin, and the largest χ².
fn chi2(map: &TagMap) -> (f64, f64) {
    let map_from_room = room_from_tag(map.origin.id).inverse();
    let of = |tag: &coshade_tracker::map::MappedTag| {
        let truth = map_from_room * room_from_tag(tag.tag.id);
        let error = lie::log(&(tag.map_from_tag * truth.inverse()));
        let covariance = tag.covariance.cholesky().unwrap();
        error.dot(&covariance.solve(&error))
    };
    let all: Vec<f64> = map.tags.iter().filter(|tag| tag.tag != map.origin).map(of).collect();
    (all.iter().sum::<f64>() / (6.0 * all.len() as f64), all.iter().copied().fold(0.0, f64::max))
}

/// Errors of tags are correlated: all of them together are at least as many independent ones as one tag has, so the
/// mean of χ²/6 is above this once in 10⁴ at most (χ² of six: 27.9), and a single χ² once in 10⁶ (38.3).
const MOST_MEAN: f64 = 27.9 / 6.0;
const MOST_SINGLE: f64 = 38.3;

#[test]
fn errors_are_as_large_as_the_covariance_says() {
    let fisheye = [250.0, 252.0, 479.5, 359.5, 0.02, -0.004, 0.001, 0.0];
    let fisheye = CameraModel::from_params(ModelKind::KannalaBrandt4, &fisheye).unwrap();
    for lens in [pinhole(), fisheye] {
        let mut means = Vec::new();
        for seed in 1..=4 {
            let map = map(&views_of(&lens, |_| SIZE_M, seed), &lens, &settings()).unwrap();
            assert_eq!((map.tags.len(), map.unconnected.len()), (TAGS as usize, 0));
            assert_eq!(map.rejected, []);
            let (mean, largest) = chi2(&map);
            assert!(mean < MOST_MEAN && largest < MOST_SINGLE, "{seed}: {mean} {largest}");
            // Thousands of degrees of freedom: the deviation of χ² per degree is below 3 %.
            assert!((map.reduced_chi2 - 1.0).abs() < 0.15, "{}", map.reduced_chi2);
            means.push(mean);
        }
        let mean = means.iter().sum::<f64>() / 4.0;
        // Of 24 independent numbers at least: mean 1, and outside of 0.2 to 2.6 less than once in 10⁴.
        assert!((0.2..2.6).contains(&mean), "{means:?}");
    }
}

#[test]
fn a_loop_closes_better_once_adjusted() {
    let lens = pinhole();
    let map = map(&views_of(&lens, |_| SIZE_M, 7), &lens, &settings()).unwrap();
    let closure = map.closure.unwrap();
    assert!(
        closure.tags.len() >= 4 && closure.views_across > 0 && closure.views_around > closure.views_across
    );
    // Once around the room is 18.8 m; the loop takes short cuts from tag to tag.
    assert!(closure.length_m > 9.0 && closure.length_m < 20.0, "{}", closure.length_m);
    assert!(closure.adjusted.translation_m < closure.chained.translation_m, "{closure:?}");
    assert!(closure.adjusted.translation_m < 0.02 * closure.length_m, "{closure:?}");
}

#[test]
fn wrong_detections_are_left_out_and_named() {
    let lens = pinhole();
    let mut views = views_of(&lens, |_| SIZE_M, 3);
    let mut wrong = Vec::new();
    for view in views.iter_mut().step_by(6) {
        // One that others see as well, moved by 30 px: no noise does that.
        if view.observations.len() < 3 {
            continue; // Of two tags nobody can say which is wrong.
        }
        let Some(seen) = view.observations.iter_mut().find(|seen| seen.tag.id % 2 == 1) else { continue };
        seen.corners_px.iter_mut().for_each(|px| *px += Vector2::new(30.0, -20.0));
        wrong.push((view.number, seen.tag));
    }
    // And one tag that is in view twice.
    let mut twin = views[8].observations[0].clone();
    twin.corners_px.iter_mut().for_each(|px| *px += Vector2::new(-80.0, 60.0));
    wrong.push((views[8].number, twin.tag));
    views[8].observations.insert(0, twin);
    let map = map(&views, &lens, &settings()).unwrap();
    let mut rejected: Vec<_> = map.rejected.iter().map(|rejected| (rejected.view, rejected.tag)).collect();
    rejected.sort_unstable();
    wrong.sort_unstable();
    assert_eq!(rejected, wrong);
    let (mean, largest) = chi2(&map);
    assert!(mean < MOST_MEAN && largest < MOST_SINGLE, "{mean} {largest}");
}

#[test]
fn sizes_are_found_from_one_that_is_known() {
    let lens = pinhole();
    let size = |id: u32| if id == 0 { SIZE_M } else { SIZE_M * (1.0 + 0.1 * (1.1 * f64::from(id)).sin()) };
    let settings =
        MapSettings { sizes_m: vec![(tag(0), SIZE_M)], free_sizes: true, ..MapSettings::default() };
    let map = map(&views_of(&lens, size, 5), &lens, &settings).unwrap();
    for own in &map.tags {
        let Some(std) = own.size_std_m else {
            assert_eq!(own.tag, tag(0));
            continue;
        };
        let error = own.size_m - size(own.tag.id);
        // Five deviations: once in 10⁶.
        assert!(error.abs() < 5.0 * std && std < 0.05 * SIZE_M, "{}: {error} ± {std}", own.tag);
    }
}

#[test]
fn a_lens_is_estimated_with_the_map() {
    let params = [610.0, 605.0, 483.0, 355.0, -0.04, 0.01, 0.001, -0.0005, 0.0];
    let truth = CameraModel::from_params(ModelKind::BrownConrady5, &params).unwrap();
    let views = views_of(&truth, |_| SIZE_M, 11);
    let plain = map(&views, &pinhole(), &settings()).unwrap();
    let refined = map(&views, &pinhole(), &MapSettings { refine_lens: true, ..settings() }).unwrap();
    assert!(plain.unexplained_px > SIGMA_PX && plain.lens_std.is_none() && plain.lens == pinhole());
    assert!(refined.unexplained_px < 0.1 * SIGMA_PX.max(plain.unexplained_px), "{}", refined.unexplained_px);
    let found = refined.lens.params();
    for ((found, truth), std) in found.iter().zip(params).zip(refined.lens_std.unwrap()) {
        assert!((found - truth).abs() < 5.0 * std, "{found} instead of {truth} ± {std}");
    }
}

#[test]
fn what_makes_no_map_is_said() {
    let lens = pinhole();
    let views = views_of(&lens, |_| SIZE_M, 1);
    let error = |views: &[View], settings: &MapSettings| map(views, &lens, settings).unwrap_err();
    assert_eq!(error(&[], &settings()), MapError::NoPairs { views: 0 });
    assert_eq!(error(&views, &MapSettings::default()), MapError::NoSize);
    let absent = MapSettings { origin: Some(tag(99)), ..settings() };
    assert_eq!(error(&views, &absent), MapError::Origin { tag: tag(99) });
    let elsewhere = MapSettings { sizes_m: vec![(tag(99), 0.1)], ..MapSettings::default() };
    assert_eq!(error(&views, &elsewhere), MapError::NoScale);
    let huge = MapSettings { size_m: Some(f64::NAN), ..MapSettings::default() };
    assert!(matches!(error(&views, &huge), MapError::Size { .. }));
    assert_eq!(map_tags(&views, &lens, &settings(), &|| false).unwrap_err(), MapError::Stopped);
    // Corners that are none.
    let mut garbage = views.clone();
    for seen in garbage.iter_mut().flat_map(|view| &mut view.observations) {
        seen.corners_px = [Vector2::new(f64::NAN, 1e300); 4];
    }
    assert!(matches!(error(&garbage, &settings()), MapError::NoPose { .. }));
}

#[test]
fn groups_that_nothing_connects_are_named() {
    let lens = pinhole();
    let mut views = views_of(&lens, |_| SIZE_M, 2);
    for view in &mut views {
        // Tags 15 to 17 only by themselves.
        let alone = view.observations.iter().any(|seen| (15..18).contains(&seen.tag.id));
        view.observations.retain(|seen| (15..18).contains(&seen.tag.id) == alone);
    }
    let map = map(&views, &lens, &MapSettings { origin: Some(tag(4)), ..settings() }).unwrap();
    assert_eq!(map.unconnected, [vec![tag(15), tag(16), tag(17)]]);
    assert_eq!((map.origin, map.tags.len()), (tag(4), 17));
    assert!(map.tag(tag(4)).unwrap().map_from_tag == Isometry3::identity());
}
