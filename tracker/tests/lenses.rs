//! Tags through lenses from a pinhole to a fish-eye of 190°: found, and as exact as through a pinhole.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

mod common;

use std::f64::consts::TAU;

use common::{Look, PlacedTag, Random, picture};
use coshade_capture::Timestamp;
use coshade_lens::calibration::Calibration;
use coshade_lens::model::{CameraModel, ModelKind};
use coshade_lens::response::Response;
use coshade_tracker::{Body, Family, TagId, Tracker, TrackerSettings};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

const TAG: TagId = TagId { family: Family::Tag36h11, id: 42 };
const SIZE_M: f64 = 0.1;
const SIZE_PX: [u32; 2] = [400, 400];
const TAGS: usize = 16;

struct Lens {
    name: &'static str,
    model: CameraModel,
    /// Tags are up to this far off the axis.
    off_axis_deg: f64,
}

fn lenses() -> Vec<Lens> {
    let lens = |name, kind, params: &[f64], off_axis_deg| Lens {
        name,
        model: CameraModel::from_params(kind, params).unwrap(),
        off_axis_deg,
    };
    // All with 140 to 150 px a radian in the middle, so that tags have about the same size.
    vec![
        lens("pinhole", ModelKind::Pinhole, &[150.0, 150.0, 199.5, 199.5], 35.0),
        lens(
            "webcam",
            ModelKind::BrownConrady5,
            &[150.0, 150.0, 198.0, 201.0, -0.2, 0.03, 0.001, -0.001, 0.0],
            35.0,
        ),
        lens(
            "fish-eye 190°",
            ModelKind::KannalaBrandt4,
            &[115.0, 115.0, 199.0, 200.0, 0.01, -0.002, 0.0, 0.0],
            80.0,
        ),
        lens("double sphere", ModelKind::DoubleSphere, &[85.0, 85.0, 199.5, 199.5, -0.2, 0.57], 80.0),
    ]
}

/// Facing the camera from some direction, tilted by up to 50°.
fn placed(random: &mut Random, off_axis_deg: f64) -> PlacedTag {
    let (off_axis, azimuth) = (random.within(0.0, off_axis_deg).to_radians(), random.within(0.0, TAU));
    let away = Vector3::new(off_axis.sin() * azimuth.cos(), off_axis.sin() * azimuth.sin(), off_axis.cos());
    let facing = UnitQuaternion::rotation_between(&-Vector3::z(), &away)
        .unwrap_or(UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let across = facing * Vector3::new(azimuth.sin(), azimuth.cos(), 0.0);
    let tilt = UnitQuaternion::from_axis_angle(&Unit::new_normalize(across), random.within(0.0, 0.87));
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), random.within(0.0, TAU));
    let camera_from_tag =
        Isometry3::from_parts(Translation3::from(away * random.within(0.25, 0.4)), tilt * facing * roll);
    PlacedTag { tag: TAG, size_m: SIZE_M, camera_from_tag }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn tags_are_found_and_exact_through_every_lens() {
    let mut figures = Vec::new();
    for Lens { name, model, off_axis_deg } in lenses() {
        let calibration = Calibration {
            model,
            response: Response::Linear,
            ..Calibration::default_for(SIZE_PX, 1.0).unwrap()
        };
        let body = Body::single(TAG, SIZE_M);
        let mut random = Random(3);
        let (mut found, mut corners_px, mut turn_deg, mut shift) = (0, Vec::new(), Vec::new(), Vec::new());
        for seed in 0..TAGS as u64 {
            let tag = placed(&mut random, off_axis_deg);
            let (truth, pose) = (tag.corners_px(&model), tag.camera_from_tag);
            let image = picture(&model, SIZE_PX, &[tag], &Look { seed, ..Look::default() });
            let mut tracker =
                Tracker::new(&calibration, std::slice::from_ref(&body), TrackerSettings::default()).unwrap();
            let tracking = tracker.track(&image.luma(), Timestamp::from_ns(0));
            let Some(tag) = tracking.tags.first() else { continue };
            found += 1;
            let error = tag.observation.corners_px.iter().zip(&truth).map(|(a, b)| (a - b).norm_squared());
            corners_px.push((error.sum::<f64>() / 4.0).sqrt());
            let body = &tracking.bodies[0];
            if !body.measured.certainty.is_ambiguous() {
                turn_deg.push(body.camera_from_body.rotation.angle_to(&pose.rotation).to_degrees());
                let error_m = (body.camera_from_body.translation.vector - pose.translation.vector).norm();
                shift.push(error_m / pose.translation.vector.norm());
            }
        }
        let clear = turn_deg.len();
        let (px, deg, part) = (median(corners_px), median(turn_deg), median(shift));
        println!(
            "{name:14} {found} of {TAGS} found, {clear} clear: corners {px:.4} px, {deg:.3}°, {:.4} %",
            part * 100.0
        );
        figures.push((name, found, px, deg, part));
    }
    for (name, found, px, deg, part) in figures {
        assert!(found + 1 >= TAGS, "{name}: {found} of {TAGS}");
        // 0.7 times what corners of the AprilTag library and OpenCV's IPPE reach with a pinhole (`tests/peers/tags.py`):
        // medians of 0.16° and 0.055 % of the distance.
        assert!(px < 0.05 && deg < 0.11 && part < 0.000_39, "{name}: {px} px, {deg}°, {part}");
    }
}
