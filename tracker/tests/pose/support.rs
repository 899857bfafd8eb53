//! Made-up views with normal errors.

use std::f64::consts::{PI, TAU};

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_tracker::{Body, BodyTag, Family, TagId, TagObservation};
use nalgebra::{Isometry3, SMatrix, Translation3, UnitQuaternion, Vector2, Vector3};

/// Random numbers (splitmix64).
pub struct Random(pub u64);

impl Random {
    /// From 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Standard normal (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

pub const FOCAL_PX: f64 = 800.0;

/// 1280 × 720 without distortion.
pub fn pinhole() -> CameraModel {
    CameraModel::from_params(ModelKind::Pinhole, &[FOCAL_PX, FOCAL_PX, 639.5, 359.5]).unwrap()
}

/// A fish-eye that sees 190° and more.
pub fn fisheye() -> CameraModel {
    let lens = CameraModel::from_params(
        ModelKind::KannalaBrandt4,
        &[420.0, 420.0, 799.5, 799.5, 0.02, -0.006, 0.0008, 0.0],
    )
    .unwrap();
    assert!(lens.max_angle_rad() > 95f64.to_radians());
    lens
}

pub fn tag(id: u32) -> TagId {
    TagId { family: Family::Tag36h11, id }
}

/// Tags of `size_m` in rows and columns on one sheet.
pub fn board(columns: u32, rows: u32, size_m: f64, pitch_m: f64) -> Body {
    let place = |i: u32, count: u32| (f64::from(i) - f64::from(count - 1) / 2.0) * pitch_m;
    let tags = (0..rows * columns).map(|id| {
        let at = Translation3::new(place(id % columns, columns), place(id / columns, rows), 0.0);
        BodyTag { tag: tag(id), size_m, body_from_tag: at.into() }
    });
    Body { name: "board".into(), tags: tags.collect() }
}

/// A tag on each face of a cube.
pub fn cube(size_m: f64, edge_m: f64) -> Body {
    let turns = [
        Vector3::zeros(),
        Vector3::x() * (PI / 2.0),
        -Vector3::x() * (PI / 2.0),
        Vector3::y() * (PI / 2.0),
        -Vector3::y() * (PI / 2.0),
        Vector3::x() * PI,
    ];
    let tags = turns.iter().zip(0..).map(|(turn, id)| {
        let turned = Isometry3::rotation(*turn);
        let body_from_tag = turned * Translation3::new(0.0, 0.0, edge_m / 2.0);
        BodyTag { tag: tag(id), size_m, body_from_tag }
    });
    Body { name: "cube".into(), tags: tags.collect() }
}

/// A pose at `distance_m` along `sight` (a unit vector), facing the camera but for `tilt_rad` about a random axis, and
/// turned about its normal at random.
pub fn facing(sight: &Vector3<f64>, distance_m: f64, tilt_rad: f64, random: &mut Random) -> Isometry3<f64> {
    let along = UnitQuaternion::rotation_between(&Vector3::z(), sight).unwrap();
    let azimuth = random.between(0.0, TAU);
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * tilt_rad);
    let front = UnitQuaternion::from_scaled_axis(Vector3::x() * PI);
    let roll = UnitQuaternion::from_scaled_axis(Vector3::z() * random.between(0.0, TAU));
    Isometry3::from_parts(Translation3::from(sight * distance_m), along * tilt * front * roll)
}

/// The direction of a pixel at random inside a 1280 × 720 image, `margin_px` from its edge.
pub fn sight(lens: &CameraModel, margin_px: f64, random: &mut Random) -> Vector3<f64> {
    let px = Vector2::new(
        random.between(margin_px, 1279.0 - margin_px),
        random.between(margin_px, 719.0 - margin_px),
    );
    lens.unproject(&px).unwrap()
}

/// Whether a tag shows its front.
pub fn is_facing(camera_from_tag: &Isometry3<f64>) -> bool {
    let normal = camera_from_tag.rotation * Vector3::z();
    normal.dot(&camera_from_tag.translation.vector) < -0.1 * camera_from_tag.translation.vector.norm()
}

/// The tags of a body that show their front, with normal errors of `sigma_px` on their corners.
pub fn observe(
    lens: &CameraModel,
    body: &Body,
    camera_from_body: &Isometry3<f64>,
    sigma_px: f64,
    random: &mut Random,
) -> Vec<TagObservation> {
    observe_moving(lens, body, |_| *camera_from_body, sigma_px, random)
}

/// As [`observe`] of a body whose pose depends on the row that sees it.
pub fn observe_moving(
    lens: &CameraModel,
    body: &Body,
    camera_from_body: impl Fn(f64) -> Isometry3<f64>,
    sigma_px: f64,
    random: &mut Random,
) -> Vec<TagObservation> {
    let seen_by_its_row = |corner| {
        let mut row = 0.0;
        let mut px = Vector2::zeros();
        // The row of a corner depends on its time, and that on its row: a contraction by row speed × time per row.
        for _ in 0..60 {
            px = lens.project(&(camera_from_body(row) * corner as nalgebra::Point3<f64>).coords)?;
            row = px.y;
        }
        Some(px)
    };
    let mut observations = Vec::new();
    for own in &body.tags {
        if !is_facing(&(camera_from_body(0.0) * own.body_from_tag)) {
            continue;
        }
        let corners = own.corners_m().map(seen_by_its_row);
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        let mut noisy = |px: Vector2<f64>| px + Vector2::new(random.normal(), random.normal()) * sigma_px;
        observations.push(TagObservation {
            tag: own.tag,
            corners_px: [noisy(a), noisy(b), noisy(c), noisy(d)],
            covariance_px2: SMatrix::identity() * (sigma_px * sigma_px).max(1e-12),
        });
    }
    observations
}

/// The pose that a flat body at `pose` is mistaken for: its plane mirrored at the plane across the line of sight.
pub fn mirrored(pose: &Isometry3<f64>) -> UnitQuaternion<f64> {
    let sight = pose.translation.vector.normalize();
    let across = nalgebra::Matrix3::identity() - sight * sight.transpose() * 2.0;
    let flat = nalgebra::Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    let turned = across * pose.rotation.to_rotation_matrix().into_inner() * flat;
    UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(turned))
}
