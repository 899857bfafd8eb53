//! Refined corners against the truth.

#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "clippy knows only functions marked as tests as tests"
)]

mod common;

use std::f64::consts::TAU;

use common::{Look, Picture, PlacedTag, Random, picture};
use coshade_lens::model::{CameraModel, ModelKind};
use coshade_lens::response::Response;
use coshade_tracker::refine::{RefineError, RefineSettings, Refined, Refiner};
use coshade_tracker::{Family, Luma, TagId};
use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector2, Vector3};

const TAG: TagId = TagId { family: Family::Tag36h11, id: 17 };
const SIZE_M: f64 = 0.1;

fn pinhole() -> CameraModel {
    CameraModel::from_params(ModelKind::Pinhole, &[300.0, 300.0, 99.3, 80.4]).unwrap()
}

fn fisheye() -> CameraModel {
    CameraModel::from_params(
        ModelKind::KannalaBrandt4,
        &[180.0, 180.0, 299.5, 299.5, 0.02, -0.004, 0.001, -0.0002],
    )
    .unwrap()
}

/// A tag that faces the camera from `direction`, tilted and turned at random.
fn placed(random: &mut Random, direction: Vector3<f64>, distance_m: f64, max_tilt_deg: f64) -> PlacedTag {
    let away = direction.normalize();
    // z of the tag towards the camera.
    let facing = UnitQuaternion::rotation_between(&Vector3::z(), &-away)
        .unwrap_or(UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let side = Vector3::x() - away * away.x;
    let azimuth =
        UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(away), random.within(0.0, TAU));
    let axis = nalgebra::Unit::new_normalize(azimuth * side);
    let tilt = UnitQuaternion::from_axis_angle(&axis, random.within(0.0, max_tilt_deg).to_radians());
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), random.within(0.0, TAU));
    let camera_from_tag = Isometry3::from_parts(Translation3::from(away * distance_m), tilt * facing * roll);
    PlacedTag { tag: TAG, size_m: SIZE_M, camera_from_tag }
}

/// Corners as a detector might find them: up to `px` off.
fn roughly(random: &mut Random, corners: [Vector2<f64>; 4], px: f64) -> [Vector2<f64>; 4] {
    corners.map(|corner| corner + Vector2::new(random.within(-px, px), random.within(-px, px)))
}

fn refiner(lens: &CameraModel) -> Refiner {
    // Without the floor of the covariance: here nothing but noise is wrong.
    Refiner::new(
        Some(*lens),
        &Response::Linear,
        RefineSettings { floor_px: 0.0, ..RefineSettings::default() },
    )
}

fn errors(refined: &Refined, truth: &[Vector2<f64>; 4]) -> SVector<f64, 8> {
    let differences =
        refined.observation.corners_px.iter().zip(truth).flat_map(|(a, b)| [a.x - b.x, a.y - b.y]);
    SVector::from_iterator(differences)
}

/// The stated covariance must be that of the errors: their Mahalanobis distances follow χ² of 8 degrees of freedom.
/// Mean 8, standard deviation 4 each: the mean of n stays within 4·4/√n, were the noise all there is. The floor of the
/// covariance makes it smaller, what the model leaves out larger.
fn check_accuracy(lens: &CameraModel, direction_at: impl Fn(&mut Random) -> Vector3<f64>, max_rms_px: f64) {
    let mut random = Random(7);
    let (mut squares, mut distances) = (0.0, Vec::new());
    const TRIALS: usize = 60;
    for trial in 0..TRIALS {
        let direction = direction_at(&mut random);
        let distance_m = random.within(0.3, 1.0);
        let tag = placed(&mut random, direction, distance_m, 60.0);
        let look = Look {
            seed: trial as u64,
            blur_px: random.within(0.4, 1.4),
            noise: random.within(1.0, 5.0),
            ..Look::default()
        };
        let size_px = if matches!(lens, CameraModel::Pinhole(_)) { [200, 160] } else { [600, 600] };
        let truth = tag.corners_px(lens);
        let image = picture(lens, size_px, &[tag], &look);
        let refined = refiner(lens).refine(&image.luma(), TAG, &roughly(&mut random, truth, 0.7)).unwrap();
        let error = errors(&refined, &truth);
        squares += error.norm_squared() / 4.0;
        let inverse = refined.observation.covariance_px2.try_inverse().unwrap();
        distances.push((error.transpose() * inverse * error)[0]);
    }
    distances.sort_by(f64::total_cmp);
    let (rms_px, median) = ((squares / TRIALS as f64).sqrt(), distances[TRIALS / 2]);
    println!(
        "rms {rms_px:.4} px, median of the squared distances {median:.2}, largest {:.1}",
        distances[TRIALS - 1]
    );
    assert!(rms_px < max_rms_px, "{rms_px}");
    // Median of χ²(8): 7.34; that of 60 trials lies within ±1.9 in 99.7 % of cases.
    assert!((3.0..9.3).contains(&median), "{median}");
}

#[test]
fn corners_and_their_covariance_are_right_in_a_pinhole() {
    check_accuracy(
        &pinhole(),
        |random| Vector3::new(random.within(-0.08, 0.08), random.within(-0.06, 0.06), 1.0),
        0.08,
    );
}

#[test]
fn corners_and_their_covariance_are_right_in_a_fish_eye_to_80_degrees() {
    let direction = |random: &mut Random| {
        let (off_axis, azimuth) = (random.within(0.0, 80.0).to_radians(), random.within(0.0, TAU));
        Vector3::new(off_axis.sin() * azimuth.cos(), off_axis.sin() * azimuth.sin(), off_axis.cos())
    };
    check_accuracy(&fisheye(), direction, 0.12);
}

fn frontal(seed: u64) -> (Picture, [Vector2<f64>; 4]) {
    let tag = placed(&mut Random(seed), Vector3::z(), 0.4, 30.0);
    let truth = tag.corners_px(&pinhole());
    (picture(&pinhole(), [200, 160], &[tag], &Look { seed, ..Look::default() }), truth)
}

/// Everything darker than half way grown by some tenths of a pixel: ink that spread, or a curve unknown to the fit.
#[test]
fn a_response_curve_that_nobody_knows_of_hardly_moves_corners() {
    let (linear, truth) = frontal(3);
    let curved: Vec<u8> = linear
        .pixels
        .iter()
        .map(|code| (255.0 * (f64::from(*code) / 255.0).powf(1.0 / 2.2)).round() as u8)
        .collect();
    let image = Luma::new(&curved, 200, 160, 200).unwrap();
    let lens = pinhole();
    let refined = refiner(&lens).refine(&image, TAG, &truth).unwrap();
    // Edges of a tag's border alone would move by more: the curve puts half-way 0.35 standard deviations of the blur out.
    assert!(errors(&refined, &truth).amax() < 0.06, "{}", errors(&refined, &truth));
    let mut known = Refiner::new(Some(lens), &Response::Gamma { gamma: 2.2 }, RefineSettings::default());
    let refined = known.refine(&image, TAG, &truth).unwrap();
    assert!(errors(&refined, &truth).amax() < 0.05, "{}", errors(&refined, &truth));
}

#[test]
fn what_covers_a_corner_does_not_pull_it() {
    let (mut image, truth) = frontal(4);
    let covered = truth[1];
    for y in 0..160_u32 {
        for x in 0..200_u32 {
            if (Vector2::new(f64::from(x), f64::from(y)) - covered).norm() < 9.0 {
                image.pixels[(y * 200 + x) as usize] = 128;
            }
        }
    }
    let refined = refiner(&pinhole()).refine(&image.luma(), TAG, &truth).unwrap();
    assert!(errors(&refined, &truth).amax() < 0.12, "{}", errors(&refined, &truth));
}

#[test]
fn what_is_not_there_is_not_found() {
    let (image, truth) = frontal(5);
    let lens = pinhole();
    let refine = |pixels: &[u8], tag: TagId, corners: &[Vector2<f64>; 4]| {
        refiner(&lens).refine(&Luma::new(pixels, 200, 160, 200).unwrap(), tag, corners)
    };
    let other = TagId { id: 18, ..TAG };
    assert!(refine(&image.pixels, other, &truth).is_err(), "another tag");
    for code in [0, 128, 255] {
        assert!(refine(&[code; 200 * 160], TAG, &truth).is_err(), "nothing but {code}");
    }
    let mut random = Random(1);
    let noise: Vec<u8> = (0..200 * 160).map(|_| random.bits() as u8).collect();
    assert!(refine(&noise, TAG, &truth).is_err(), "noise");
    let mut backwards = truth;
    backwards.reverse();
    assert!(matches!(refine(&image.pixels, TAG, &backwards), Err(RefineError::Corners(_))));
    for wrong in [
        [Vector2::zeros(); 4],
        [Vector2::repeat(f64::NAN); 4],
        truth.map(|c| c * 1e9),
        truth.map(|c| c * 1e-9),
    ] {
        assert!(refine(&image.pixels, TAG, &wrong).is_err());
    }
    let nearly_outside = truth.map(|corner| corner + Vector2::new(150.0, 0.0));
    assert!(refine(&image.pixels, TAG, &nearly_outside).is_err());
    let unknown = TagId { id: 70_000, ..TAG };
    assert!(matches!(refine(&image.pixels, unknown, &truth), Err(RefineError::Tag(_))));
    let one = refiner(&lens).refine(&Luma::new(&[7], 1, 1, 1).unwrap(), TAG, &truth);
    assert!(one.is_err());
}

#[test]
fn corners_a_cell_off_are_found() {
    let (image, truth) = frontal(6);
    let cell_px = (truth[0] - truth[1]).norm() / 8.0;
    let mut random = Random(11);
    let mut found = 0;
    for _ in 0..40 {
        let start = roughly(&mut random, truth, 0.5 * cell_px);
        let refined = refiner(&pinhole()).refine(&image.luma(), TAG, &start);
        found += u32::from(refined.is_ok_and(|refined| errors(&refined, &truth).amax() < 0.1));
    }
    assert!(found >= 38, "{found} of 40");
}
