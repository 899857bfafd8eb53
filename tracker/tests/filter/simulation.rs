//! One tag moving before a pinhole camera, its measured poses, and what a filter makes of them.

use coshade_capture::Timestamp;
use coshade_tracker::lie;
use nalgebra::{Isometry3, Matrix6, SMatrix, SVector, Translation3, UnitQuaternion, Vector3, Vector6};

const FOCAL_PX: f64 = 900.0;
const TAG_M: f64 = 0.1;
const DISTANCE_M: f64 = 0.6;
/// Of a corner, on each axis.
pub const CORNER_NOISE_PX: f64 = 0.1;

/// Motions; speeds are of the tag's centre in the image.
#[derive(Clone, Copy, Debug)]
pub enum Motion {
    /// Along the image, in px per frame at 30 frames/s.
    Steady { px_per_frame: f64 },
    /// The camera turns about its own axes.
    Turning { px_per_frame: f64 },
    /// Rests a second, goes a second, rests a second, ...
    StopAndGo { px_per_frame: f64 },
    /// All six directions with phases of their own, so many px of amplitude aside.
    Tremor { hz: f64, amplitude_px: f64 },
    /// Aside only.
    Shake { hz: f64, amplitude_px: f64 },
    /// Jumps every second.
    Steps { px: f64 },
}

impl Motion {
    pub fn pose(self, time_s: f64) -> Isometry3<f64> {
        let metres = DISTANCE_M / FOCAL_PX;
        let start = Isometry3::from_parts(
            Translation3::new(0.02, -0.01, DISTANCE_M),
            UnitQuaternion::from_euler_angles(std::f64::consts::PI - 0.5, 0.3, 0.2),
        );
        let aside = |px: f64| Vector6::new(0.0, 0.0, 0.0, px * metres, 0.4 * px * metres, 0.0);
        let twist = match self {
            // To and fro, so that a fast tag stays in view: a triangle wave over 400 px.
            Self::Steady { px_per_frame } => aside(triangle(px_per_frame * 30.0 * time_s, 400.0)),
            Self::Turning { px_per_frame } => {
                let px = triangle(px_per_frame * 30.0 * time_s, 400.0);
                Vector6::new(0.3, 1.0, 0.5, 0.0, 0.0, 0.0) * (px / FOCAL_PX)
            }
            Self::StopAndGo { px_per_frame } => {
                let gone_s = (time_s / 2.0).floor() + (time_s % 2.0 - 1.0).max(0.0);
                aside(triangle(px_per_frame * 30.0 * gone_s, 400.0))
            }
            Self::Tremor { hz, amplitude_px } => {
                let wave = |phase: f64| (std::f64::consts::TAU * hz * time_s + phase).sin() * amplitude_px;
                let turn = 1.0 / FOCAL_PX;
                Vector6::new(
                    wave(0.3) * turn,
                    wave(1.7) * turn,
                    wave(2.9) * turn,
                    wave(0.0) * metres,
                    wave(4.1) * metres,
                    wave(5.3) * metres,
                )
            }
            Self::Shake { hz, amplitude_px } => {
                aside((std::f64::consts::TAU * hz * time_s).sin() * amplitude_px)
            }
            Self::Steps { px } => aside(if time_s % 2.0 < 1.0 { 0.0 } else { px }),
        };
        lie::exp(&twist) * start
    }
}

fn triangle(way: f64, width: f64) -> f64 {
    let phase = (way + width / 2.0).rem_euclid(2.0 * width);
    phase.min(2.0 * width - phase) - width / 2.0
}

/// Corners of the tag in the image, x and y in turn.
pub fn corners_px(camera_from_body: &Isometry3<f64>) -> SVector<f64, 8> {
    let half = TAG_M / 2.0;
    let corners = [(-half, half), (half, half), (half, -half), (-half, -half)];
    SVector::from_fn(|row, _| {
        let (x, y) = corners[row / 2];
        let point = camera_from_body * nalgebra::Point3::new(x, y, 0.0);
        FOCAL_PX * (if row % 2 == 0 { point.x } else { point.y }) / point.z
    })
}

/// Covariance of a least-squares pose, corners disturbed by [`CORNER_NOISE_PX`].
pub fn covariance(camera_from_body: &Isometry3<f64>) -> Matrix6<f64> {
    const STEP: f64 = 1e-6;
    let mut jacobian = SMatrix::<f64, 8, 6>::zeros();
    for i in 0..6 {
        let at = |step: f64| corners_px(&(lie::exp(&Vector6::ith(i, step)) * camera_from_body));
        jacobian.set_column(i, &((at(STEP) - at(-STEP)) / (2.0 * STEP)));
    }
    let information = jacobian.transpose() * jacobian;
    information.try_inverse().unwrap() * CORNER_NOISE_PX.powi(2)
}

/// Normal numbers from a splitmix64 generator.
pub struct Noise(pub u64);

impl Noise {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// How a run is recorded.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    pub frames_per_s: f64,
    pub frames: usize,
    /// True standard deviation over what the covariance says.
    pub noise_scale: f64,
    /// Stamps wander by this share of a frame, evenly distributed.
    pub stamp_wander: f64,
    /// Share of frames that are lost.
    pub dropped: f64,
    pub seed: u64,
}

impl Default for Run {
    fn default() -> Self {
        Self { frames_per_s: 30.0, frames: 1500, noise_scale: 1.0, stamp_wander: 0.0, dropped: 0.0, seed: 1 }
    }
}

/// Mean square overlay errors, in px².
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    pub raw: f64,
    pub filtered: f64,
}

impl Errors {
    /// Filtered over raw, of the root mean squares.
    pub fn ratio(&self) -> f64 {
        (self.filtered / self.raw).sqrt()
    }
}

type Filter<'a> = dyn FnMut(Timestamp, &Isometry3<f64>, &Matrix6<f64>) -> Isometry3<f64> + 'a;

/// Feeds a filter a run, the errors of the frames from `settled` on.
pub fn errors(motion: Motion, run: &Run, settled: usize, filter: &mut Filter<'_>) -> Errors {
    let mut noise = Noise(run.seed);
    let mut sum = Errors::default();
    let mut counted = 0.0;
    for frame in 0..run.frames {
        let time_s = 1.0 + (frame as f64 + run.stamp_wander * (noise.uniform() - 0.5)) / run.frames_per_s;
        let truth = motion.pose(time_s);
        let covariance = covariance(&truth);
        let disturbance =
            covariance.cholesky().unwrap().l() * Vector6::from_fn(|_, _| noise.normal()) * run.noise_scale;
        if noise.uniform() < run.dropped {
            continue;
        }
        let measured = lie::exp(&disturbance) * truth;
        let filtered = filter(Timestamp::from_ns((time_s * 1e9) as u64), &measured, &covariance);
        if frame >= settled {
            sum.raw += (corners_px(&measured) - corners_px(&truth)).norm_squared();
            sum.filtered += (corners_px(&filtered) - corners_px(&truth)).norm_squared();
            counted += 1.0;
        }
    }
    Errors { raw: sum.raw / counted, filtered: sum.filtered / counted }
}

/// A turn by so much, for tests that want another pose.
#[allow(dead_code, reason = "not every user of this file turns")]
pub fn turned(pose: &Isometry3<f64>, by_rad: f64) -> Isometry3<f64> {
    UnitQuaternion::new(Vector3::new(by_rad, 0.0, 0.0)) * pose
}
