//! From what the tracker has measured to what is printed.

use coshade_tracker::{Certainty, PlanarPose, PoseEstimate, TrackedBody, TrackedTag, Tracking};
use nalgebra::{Matrix3, Matrix3x6};

use super::bodies::Anchor;
use super::rows::{BodyRow, FrameRow, PlanarRow, PoseRow, RejectedRow, TagRow};
use crate::pipeline::TrackedFrame;

/// What is printed of a frame.
pub fn row(tracked: &TrackedFrame<Tracking>, anchor: Option<&Anchor>) -> FrameRow {
    let TrackedFrame { frame, tracking, .. } = tracked;
    let bodies: Vec<BodyRow> = tracking.bodies.iter().map(body_row).collect();
    let world_from_camera = anchor.and_then(|anchor| {
        let body = bodies.iter().find(|body| body.name == anchor.body)?;
        Some(PoseRow::from(anchor.world_from_body * body.camera_from_body.isometry().inverse()))
    });
    let misfit = |body: &TrackedBody| body.measured.misfit.map(|misfit| format!("{}: {misfit}", body.name));
    let misfits = tracking.bodies.iter().filter_map(misfit);
    FrameRow {
        frame: frame.sequence,
        captured_ns: frame.captured.as_ns(),
        latency_ms: tracked.tracked.saturating_since(tracked.taken).as_secs_f64() * 1e3,
        searched: tracking.searched,
        world_from_camera,
        bodies,
        tags: tracking.tags.iter().map(tag_row).collect(),
        warnings: tracking.warnings.iter().cloned().chain(misfits).collect(),
    }
}

fn body_row(body: &TrackedBody) -> BodyRow {
    let pose = &body.measured;
    let (position_std_m, rotation_std_rad) = deviations(&pose.estimate);
    BodyRow {
        name: body.name.clone(),
        camera_from_body: body.camera_from_body.into(),
        measured_camera_from_body: pose.estimate.camera_from_body.into(),
        position_std_mm: position_std_m.map(|std| std * 1e3),
        rotation_std_deg: rotation_std_rad.map(f64::to_degrees),
        rms_px: pose.estimate.rms_px,
        reduced_chi2: pose.estimate.reduced_chi2(),
        certainty: match pose.certainty {
            Certainty::Clear => "clear",
            Certainty::ByPast { .. } => "by_past",
            Certainty::Ambiguous { .. } => "ambiguous",
        },
        other_camera_from_body: pose.certainty.other().map(|other| other.camera_from_body.into()),
        tags_used: pose.used.iter().map(ToString::to_string).collect(),
        tags_rejected: pose
            .rejected
            .iter()
            .map(|rejected| RejectedRow {
                tag: rejected.tag.to_string(),
                reason: rejected.reason.to_string(),
            })
            .collect(),
    }
}

/// Standard deviations of the body's origin and of its rotation, along and about the camera's axes.
fn deviations(estimate: &PoseEstimate) -> ([f64; 3], [f64; 3]) {
    // A twist δ = (ω, v) on the left moves the origin t by ω × t + v.
    let covariance = &estimate.covariance;
    let origin = estimate.camera_from_body.translation.vector;
    let mut by_twist = Matrix3x6::zeros();
    by_twist.fixed_view_mut::<3, 3>(0, 0).copy_from(&-origin.cross_matrix());
    by_twist.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    let position = by_twist * covariance * by_twist.transpose();
    let deviation = |variance: f64| variance.max(0.0).sqrt();
    ([0, 1, 2].map(|i| deviation(position[(i, i)])), [0, 1, 2].map(|i| deviation(covariance[(i, i)])))
}

fn tag_row(tag: &TrackedTag) -> TagRow {
    let pose =
        |pose: &PlanarPose| PlanarRow { camera_from_tag: pose.camera_from_tag.into(), rms_px: pose.rms_px };
    TagRow {
        family: tag.observation.tag.family.name(),
        id: tag.observation.tag.id,
        corners_px: tag.observation.corners_px.map(Into::into),
        hamming: tag.found.map(|found| found.hamming),
        margin: tag.found.map(|found| found.margin),
        poses: tag.poses.iter().flatten().map(pose).collect(),
    }
}
