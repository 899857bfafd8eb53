//! What is printed of a frame, with the names that JSON has.

use std::fmt::Write as _;

use nalgebra::Isometry3;
use serde::Serialize;

/// A frame and what was found in it.
#[derive(Clone, Debug, Serialize)]
pub struct FrameRow {
    /// Number of the frame, as its source counts.
    pub frame: u64,
    /// Middle of the exposure, nanoseconds.
    pub captured_ns: u64,
    /// From the moment the frame was there to the end of its tracking.
    pub latency_ms: f64,
    /// Whether tags were looked for in the whole image.
    pub searched: bool,
    /// Where the camera is in the world; null while the anchor is not seen.
    pub world_from_camera: Option<PoseRow>,
    /// Bodies found.
    pub bodies: Vec<BodyRow>,
    /// Tags seen, of bodies or not.
    pub tags: Vec<TagRow>,
    /// What the tracker has to say.
    pub warnings: Vec<String>,
}

/// A body that was found.
#[derive(Clone, Debug, Serialize)]
pub struct BodyRow {
    /// Board file, or family and number of a single tag.
    pub name: String,
    /// Where it is, filtered unless the filter is off.
    pub camera_from_body: PoseRow,
    /// As measured in this very frame, without filter.
    pub measured_camera_from_body: PoseRow,
    /// Standard deviation of the measured position along the camera's axes.
    pub position_std_mm: [f64; 3],
    /// Standard deviation of the measured rotation about the camera's axes.
    pub rotation_std_deg: [f64; 3],
    /// Root mean square distance of its tags' corners from where the pose puts them.
    pub rms_px: f64,
    /// χ² per degree of freedom: about 1 if lens, body and the corners' errors are as stated.
    pub reduced_chi2: f64,
    /// Whether the pose could be another: `clear`, `by_past` (another fits as well, and earlier frames decided) or
    /// `ambiguous` (nothing decides; this is the more probable one).
    pub certainty: &'static str,
    /// The other one, null if clear.
    pub other_camera_from_body: Option<PoseRow>,
    /// Tags that the pose rests on.
    pub tags_used: Vec<String>,
    /// Tags that it does not rest on.
    pub tags_rejected: Vec<RejectedRow>,
}

/// A tag of a body that was left out.
#[derive(Clone, Debug, Serialize)]
pub struct RejectedRow {
    /// Family and number.
    pub tag: String,
    /// Why.
    pub reason: String,
}

/// A tag that was seen.
#[derive(Clone, Debug, Serialize)]
pub struct TagRow {
    /// Family.
    pub family: &'static str,
    /// Number within the family.
    pub id: u32,
    /// Lower left, lower right, upper right, upper left of the print; (0, 0) is the centre of the first pixel.
    pub corners_px: [[f64; 2]; 4],
    /// Wrong bits that were corrected; null if it was followed from an earlier frame.
    pub hamming: Option<u32>,
    /// Mean difference of the bits' brightness from the threshold, codes; null as above.
    pub margin: Option<f32>,
    /// Both poses that a flat square can have, the better one first; empty if its size is unknown.
    pub poses: Vec<PlanarRow>,
}

/// One of the two poses of a flat square.
#[derive(Clone, Debug, Serialize)]
pub struct PlanarRow {
    /// Tag to camera frame.
    pub camera_from_tag: PoseRow,
    /// How well it fits the corners.
    pub rms_px: f64,
}

/// A rigid motion.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PoseRow {
    /// Where the origin is.
    pub position_m: [f64; 3],
    /// Real part last.
    pub quaternion_xyzw: [f64; 4],
    /// The same rotation: about fixed x first, then y, then z.
    pub rotation_deg: [f64; 3],
    #[serde(skip)]
    pose: Isometry3<f64>,
}

impl From<Isometry3<f64>> for PoseRow {
    fn from(pose: Isometry3<f64>) -> Self {
        let (x, y, z) = pose.rotation.euler_angles();
        let quaternion = pose.rotation.coords;
        Self {
            position_m: pose.translation.vector.into(),
            quaternion_xyzw: quaternion.into(),
            rotation_deg: [x, y, z].map(f64::to_degrees),
            pose,
        }
    }
}

impl PoseRow {
    /// As a transform.
    pub fn isometry(&self) -> &Isometry3<f64> {
        &self.pose
    }
}

/// The heading of [`FrameRow::lines`].
pub const HEADING: &str = "   frame     time s  body                     x mm      y mm      z mm   rx deg   ry deg   rz deg   \
                           rms px  tags  certainty\n";

impl FrameRow {
    /// A line for each body; one that says which tags are seen where there is none.
    pub fn lines(&self) -> String {
        let mut out = String::new();
        let start = format!("{:>8} {:>10.4}", self.frame, self.captured_ns as f64 * 1e-9);
        for body in &self.bodies {
            let [x, y, z] = body.camera_from_body.position_m.map(|m| m * 1e3);
            let [rx, ry, rz] = body.camera_from_body.rotation_deg;
            let _ = writeln!(
                out,
                "{start}  {:<20} {x:>9.2} {y:>9.2} {z:>9.2} {rx:>8.2} {ry:>8.2} {rz:>8.2} {:>8.3} {:>5}  {}",
                body.name,
                body.rms_px,
                body.tags_used.len(),
                body.certainty
            );
        }
        if self.bodies.is_empty() {
            let _ = writeln!(out, "{start}  –                    {}", self.seen());
        }
        out
    }

    fn seen(&self) -> String {
        if self.tags.is_empty() {
            return "no tags".to_owned();
        }
        let names = self.tags.iter().map(TagRow::name);
        format!("no body; tags: {}", names.collect::<Vec<_>>().join(", "))
    }
}

impl TagRow {
    /// Family and number.
    pub fn name(&self) -> String {
        format!("{} {}", self.family, self.id)
    }
}
