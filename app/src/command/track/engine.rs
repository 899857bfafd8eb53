//! The tracker at work, and its results as rows.

use coshade_capture::Timestamp;
use coshade_lens::calibration::Calibration;
use coshade_lens::model::CameraModel;
use coshade_tracker::detector::{Detector, DetectorSettings, FindTags as _};
use coshade_tracker::refine::{RefineSettings, Refiner};
use coshade_tracker::{
    Body, BodyPose, Certainty, Detection, Family, Luma, Past, PlanarPose, PoseEstimate, PoseSolver, TagId,
    TagObservation, planar_poses,
};
use nalgebra::{Matrix3, Matrix3x6, Matrix6};

use super::bodies::Anchor;
use super::rows::{BodyRow, FrameRow, PlanarRow, PoseRow, RejectedRow, TagRow};
use crate::pipeline::{Track, TrackedFrame};

/// How tags are looked for.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Those of all bodies, and more.
    pub families: Vec<Family>,
    /// Factor between the image and the one that tags are looked for in.
    pub decimate: f32,
    /// Of the detector.
    pub threads: u32,
}

/// What is in an image.
pub struct Tracking {
    tags: Vec<FoundTag>,
    bodies: Vec<(String, BodyPose)>,
    warnings: Vec<String>,
}

struct FoundTag {
    detection: Detection,
    poses: Option<[PlanarPose; 2]>,
}

/// Detection, refinement and poses, image by image.
pub struct Engine {
    detector: Detector,
    refiner: Refiner,
    lens: CameraModel,
    bodies: Vec<(Body, PoseSolver)>,
}

/// A tracker of these bodies in images of this camera.
///
/// # Errors
/// Settings out of range, bodies that cannot be.
pub fn new(calibration: &Calibration, bodies: &[Body], settings: &Settings) -> anyhow::Result<Engine> {
    let Settings { families, decimate, threads } = settings.clone();
    let lens = calibration.model;
    let height_px = calibration.size_px[1];
    let solver = |body: &Body| {
        let solver = PoseSolver::new(&lens, body)?.with_rolling_shutter(calibration.readout_s, height_px)?;
        Ok((body.clone(), solver))
    };
    Ok(Engine {
        detector: Detector::new(&DetectorSettings {
            families,
            decimate,
            threads,
            ..DetectorSettings::default()
        })?,
        refiner: Refiner::new(Some(lens), &calibration.response, RefineSettings::default()),
        lens,
        bodies: bodies.iter().map(solver).collect::<anyhow::Result<_>>()?,
    })
}

impl Track for Engine {
    type Tracking = Tracking;

    fn track(&mut self, image: &Luma<'_>, _captured: Timestamp) -> Tracking {
        let mut warnings = Vec::new();
        let found = self.detector.find(image).unwrap_or_else(|error| {
            warnings.push(error.to_string());
            Vec::new()
        });
        let (mut tags, mut observations) = (Vec::new(), Vec::new());
        for detection in found {
            match self.refiner.refine(image, detection.tag, &detection.corners_px) {
                Ok(refined) => {
                    let observation = refined.observation;
                    let poses = self
                        .size_m(detection.tag)
                        .and_then(|size_m| planar_poses(&self.lens, &observation, size_m).ok());
                    let detection = Detection { corners_px: observation.corners_px, ..detection };
                    tags.push(FoundTag { detection, poses });
                    observations.push(observation);
                }
                Err(error) => warnings.push(error.to_string()),
            }
        }
        let bodies =
            self.bodies.iter().filter_map(|(body, solver)| pose(body, solver, &observations)).collect();
        Tracking { tags, bodies, warnings }
    }
}

fn pose(body: &Body, solver: &PoseSolver, observations: &[TagObservation]) -> Option<(String, BodyPose)> {
    let own: Vec<_> =
        observations.iter().filter(|observation| body.tag(observation.tag).is_some()).cloned().collect();
    Some((body.name.clone(), solver.solve(&own, &Past::default()).ok()?))
}

impl Engine {
    fn size_m(&self, tag: TagId) -> Option<f64> {
        self.bodies.iter().find_map(|(body, _)| body.tag(tag)).map(|tag| tag.size_m)
    }
}

/// What is printed of a frame.
pub fn row(tracked: &TrackedFrame<Tracking>, anchor: Option<&Anchor>) -> FrameRow {
    let TrackedFrame { frame, tracking, .. } = tracked;
    let bodies: Vec<BodyRow> = tracking.bodies.iter().map(|(name, pose)| body_row(name, pose)).collect();
    let world_from_camera = anchor.and_then(|anchor| {
        let body = bodies.iter().find(|body| body.name == anchor.body)?;
        Some(PoseRow::from(anchor.world_from_body * body.camera_from_body.isometry().inverse()))
    });
    let misfits = tracking.bodies.iter().filter_map(|(name, pose)| Some(format!("{name}: {}", pose.misfit?)));
    FrameRow {
        frame: frame.sequence,
        captured_ns: frame.captured.as_ns(),
        latency_ms: tracked.tracked.saturating_since(tracked.taken).as_secs_f64() * 1e3,
        world_from_camera,
        bodies,
        tags: tracking.tags.iter().map(tag_row).collect(),
        warnings: tracking.warnings.iter().cloned().chain(misfits).collect(),
    }
}

fn body_row(name: &str, pose: &BodyPose) -> BodyRow {
    let PoseEstimate { camera_from_body, rms_px, .. } = pose.estimate;
    let (position_std_m, rotation_std_rad) = deviations(&pose.estimate);
    BodyRow {
        name: name.to_owned(),
        camera_from_body: camera_from_body.into(),
        measured_camera_from_body: camera_from_body.into(),
        position_std_mm: position_std_m.map(|std| std * 1e3),
        rotation_std_deg: rotation_std_rad.map(f64::to_degrees),
        rms_px,
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
    let covariance: &Matrix6<f64> = &estimate.covariance;
    let origin = estimate.camera_from_body.translation.vector;
    let mut by_twist = Matrix3x6::zeros();
    by_twist.fixed_view_mut::<3, 3>(0, 0).copy_from(&-origin.cross_matrix());
    by_twist.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    let position = by_twist * covariance * by_twist.transpose();
    let deviation = |variance: f64| variance.max(0.0).sqrt();
    ([0, 1, 2].map(|i| deviation(position[(i, i)])), [0, 1, 2].map(|i| deviation(covariance[(i, i)])))
}

fn tag_row(FoundTag { detection, poses }: &FoundTag) -> TagRow {
    let pose =
        |pose: &PlanarPose| PlanarRow { camera_from_tag: pose.camera_from_tag.into(), rms_px: pose.rms_px };
    TagRow {
        family: detection.tag.family.name(),
        id: detection.tag.id,
        corners_px: detection.corners_px.map(Into::into),
        hamming: detection.hamming,
        margin: detection.margin,
        poses: poses.iter().flatten().map(pose).collect(),
    }
}
