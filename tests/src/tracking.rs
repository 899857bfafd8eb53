//! Tracked bodies of the recorded desk against the truth about them.

use std::path::{Path, PathBuf};

use coshade_capture::recording::{Reader, RecordedTransform};
use coshade_capture::{Converter, PixelFormat, Timestamp};
use coshade_lens::calibration::Calibration;
use coshade_lens::model::CameraModel;
use coshade_tracker::{Board, Body, Family, Luma, TagId, TrackedBody, Tracker, TrackerSettings};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};

/// Why there are no figures.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct TrackingError(String);

fn failed(error: impl std::fmt::Display) -> TrackingError {
    TrackingError(error.to_string())
}

/// A body and what was found of it.
#[derive(Clone, Debug)]
pub struct BodyTruth {
    /// Its name.
    pub name: String,
    /// By frame.
    pub frames: Vec<FrameError>,
}

/// Errors in one frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameError {
    /// Number of the frame.
    pub sequence: u64,
    /// Distance of the body's origin from the true one.
    pub translation_mm: f64,
    /// Angle to the true orientation.
    pub rotation_deg: f64,
    /// Root mean square distance in the image of the corners of a box of 10 cm on the body from where they truly are.
    pub overlay_px: f64,
    /// Whether two poses fitted and nothing decided.
    pub ambiguous: bool,
    /// Tags that the pose rests on.
    pub tags: usize,
}

/// Medians and 95th percentiles.
#[derive(Clone, Copy, Debug)]
pub struct Figures {
    /// Translation.
    pub translation_mm: [f64; 2],
    /// Rotation.
    pub rotation_deg: [f64; 2],
    /// Overlay.
    pub overlay_px: [f64; 2],
}

/// A pose that is off by more is not imprecise but wrong.
const FLIP_DEG: f64 = 10.0;

impl BodyTruth {
    /// Medians and 95th percentiles over the frames.
    pub fn figures(&self) -> Figures {
        let percentiles = |value: fn(&FrameError) -> f64| {
            let mut values: Vec<f64> = self.frames.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            [50, 95].map(|percent| {
                values.get((values.len().max(1) - 1) * percent / 100).copied().unwrap_or(f64::NAN)
            })
        };
        Figures {
            translation_mm: percentiles(|frame| frame.translation_mm),
            rotation_deg: percentiles(|frame| frame.rotation_deg),
            overlay_px: percentiles(|frame| frame.overlay_px),
        }
    }

    /// Frames in which nothing decided between two poses.
    pub fn ambiguous(&self) -> usize {
        self.frames.iter().filter(|frame| frame.ambiguous).count()
    }

    /// Frames in which the pose was wrong without a word.
    pub fn flips(&self) -> usize {
        self.frames.iter().filter(|frame| !frame.ambiguous && frame.rotation_deg > FLIP_DEG).count()
    }
}

/// Tracks the board, the cube and both cards of `assets/desk.mcap`.
///
/// # Errors
/// [`TrackingError`] if a file cannot be read.
pub fn desk(settings: TrackerSettings) -> Result<Vec<BodyTruth>, TrackingError> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let bodies = desk_bodies(&root)?;
    let mut reader = Reader::open(root.join("assets/desk.mcap")).map_err(failed)?;
    let camera = reader.streams().iter().position(|stream| stream.name == "camera");
    let camera = camera.ok_or_else(|| failed("the recording has no camera"))?;
    let calibration = reader.streams()[camera].calibration_toml.clone().unwrap_or_default();
    let calibration = Calibration::parse(&calibration, "desk.mcap").map_err(failed)?;
    let poses = reader.transforms().map_err(failed)?;
    let own: Vec<Body> = bodies.iter().map(|(body, _)| body.clone()).collect();
    let mut tracker = Tracker::new(&calibration, &own, settings).map_err(failed)?;
    let name = |body: &Body| BodyTruth { name: body.name.clone(), frames: Vec::new() };
    let mut truths: Vec<BodyTruth> = own.iter().map(name).collect();
    let (mut converter, mut codes) = (Converter::new(), Vec::new());
    while let Some(read) = reader.next_frame().map_err(failed)? {
        if read.stream != camera || read.frame.format == PixelFormat::Z16 {
            continue;
        }
        let frame = read.frame;
        codes.resize((frame.width_px * frame.height_px) as usize, 0);
        converter.grey(&frame, &mut codes).map_err(failed)?;
        let image = Luma::new(&codes, frame.width_px, frame.height_px, frame.width_px).map_err(failed)?;
        let tracking = tracker.track(&image, frame.captured);
        let world_from_camera =
            pose_at(&poses, frame.captured).ok_or_else(|| failed("a frame without a pose"))?;
        for tracked in &tracking.bodies {
            for ((body, world_from_body), truth) in bodies.iter().zip(&mut truths) {
                if body.name == tracked.name {
                    let true_pose = world_from_camera.inverse() * world_from_body;
                    truth.frames.extend(error(&calibration.model, frame.sequence, tracked, &true_pose));
                }
            }
        }
    }
    Ok(truths)
}

fn error(
    lens: &CameraModel,
    sequence: u64,
    tracked: &TrackedBody,
    camera_from_body: &Isometry3<f64>,
) -> Option<FrameError> {
    let found = &tracked.camera_from_body;
    let corner =
        |i: u32| Point3::from([i & 1, i >> 1 & 1, i >> 2 & 1].map(|side| 0.1 * (f64::from(side) - 0.5)));
    let mut squares = 0.0;
    for corner in (0..8).map(corner) {
        let place = |pose: &Isometry3<f64>| lens.project(&(pose * corner).coords);
        squares += (place(found)? - place(camera_from_body)?).norm_squared();
    }
    Some(FrameError {
        sequence,
        translation_mm: (found.translation.vector - camera_from_body.translation.vector).norm() * 1e3,
        rotation_deg: found.rotation.angle_to(&camera_from_body.rotation).to_degrees(),
        overlay_px: (squares / 8.0_f64).sqrt(),
        ambiguous: tracked.measured.certainty.is_ambiguous(),
        tags: tracked.measured.used.len(),
    })
}

fn pose_at(poses: &[RecordedTransform], captured: Timestamp) -> Option<Isometry3<f64>> {
    let pose = poses.iter().find(|pose| pose.child == "camera" && pose.stamp == captured)?;
    let [x, y, z, w] = pose.rotation_xyzw;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    Some(Isometry3::from_parts(Translation3::from(pose.translation_m), rotation))
}

/// What carries tags on the desk, and where `worlds/desk.toml` puts it.
fn desk_bodies(root: &Path) -> Result<Vec<(Body, Isometry3<f64>)>, TrackingError> {
    let placed = |position_m: [f64; 3], turn_deg: f64| {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, turn_deg.to_radians());
        Isometry3::from_parts(Translation3::from(position_m), turn)
    };
    let board = |name: &str| -> Result<Body, TrackingError> {
        let path: PathBuf = root.join("worlds").join(name);
        Body::from_board(name, &Board::read(path).map_err(failed)?).map_err(failed)
    };
    let card = |id| Body::single(TagId { family: Family::Tag36h11, id }, 0.05);
    Ok(vec![
        (board("board.toml")?, placed([0.01, -0.13, 0.0009], 4.0)),
        (board("cube.toml")?, placed([-0.27, -0.08, 0.03], 28.0)),
        (card(20), placed([0.17, 0.09, 0.0009], -20.0)),
        (card(21), placed([0.33, -0.11, 0.0009], 15.0)),
    ])
}
