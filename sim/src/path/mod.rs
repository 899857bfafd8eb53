//! The path of the rig: through keyframes, with continuous acceleration.
//!
//! Positions and orientations are cubic B-splines over the keyframes' times, so both are C²; orientations by cumulative
//! basis functions (Kim, Kim, Shin, *A General Construction Scheme for Unit Quaternion Curves with Simple High Order
//! Derivatives*, SIGGRAPH 1995, eq. 5). Control points are solved for so that the curve passes through the keyframes.

mod basis;
mod solve;

use glam::{DQuat, DVec3};

use crate::pose::Rigid;
use basis::Basis;

/// A place on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyframe {
    /// When, seconds.
    pub time_s: f64,
    /// `world_from_rig`.
    pub pose: Rigid,
}

/// Where the rig is and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// `world_from_rig`.
    pub pose: Rigid,
    /// Of the rig's origin, in world coordinates, m/s.
    pub velocity_m_per_s: DVec3,
    /// In the rig's own coordinates, rad/s.
    pub angular_velocity_rad_per_s: DVec3,
}

/// Why keyframes make no path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PathError {
    /// There are none.
    #[error("no keyframes: at least one is needed")]
    Empty,
    /// Times do not rise.
    #[error(
        "keyframe {index}: time {time_s} s does not come after that of the keyframe before, by at least {MIN_STEP_S} s"
    )]
    Order {
        /// Which, from 0.
        index: usize,
        /// Its time.
        time_s: f64,
    },
    /// A turn of more than half a circle has two ways.
    #[error(
        "keyframe {index}: turned by {angle_deg:.0}° against the one before; at most {MAX_TURN_DEG}° are allowed, put one between"
    )]
    Turn {
        /// Which, from 0.
        index: usize,
        /// How far.
        angle_deg: f64,
    },
    /// No curve was found.
    #[error(
        "no smooth curve passes through the keyframes: their times are too uneven or they turn too fast; put more between"
    )]
    NoCurve,
}

/// Nearest that keyframes may follow each other.
pub const MIN_STEP_S: f64 = 1e-3;
/// Farthest that the rig may turn from one keyframe to the next.
pub const MAX_TURN_DEG: f64 = 120.0;

/// A smooth path. Before its first keyframe and behind its last the rig stands still.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Of the keyframes, rising.
    times_s: Vec<f64>,
    /// One more than keyframes at either end.
    positions_m: Vec<DVec3>,
    rotations: Vec<DQuat>,
}

impl Path {
    /// Through keyframes.
    ///
    /// # Errors
    /// [`PathError`] names the keyframe that does not fit.
    pub fn new(keyframes: &[Keyframe]) -> Result<Self, PathError> {
        if keyframes.is_empty() {
            return Err(PathError::Empty);
        }
        for (index, (last, next)) in keyframes.iter().zip(keyframes.iter().skip(1)).enumerate() {
            let index = index + 1;
            let step_s = next.time_s - last.time_s;
            if step_s.is_nan() || step_s < MIN_STEP_S {
                return Err(PathError::Order { index, time_s: next.time_s });
            }
            let angle_deg = last.pose.rotation.angle_between(next.pose.rotation).to_degrees();
            if angle_deg > MAX_TURN_DEG {
                return Err(PathError::Turn { index, angle_deg });
            }
        }
        let times_s: Vec<f64> = keyframes.iter().map(|keyframe| keyframe.time_s).collect();
        let places: Vec<DVec3> = keyframes.iter().map(|keyframe| keyframe.pose.position_m).collect();
        let turns: Vec<DQuat> = keyframes.iter().map(|keyframe| keyframe.pose.rotation).collect();
        let positions_m = solve::positions(&times_s, &places).ok_or(PathError::NoCurve)?;
        let rotations = solve::rotations(&times_s, &turns).ok_or(PathError::NoCurve)?;
        Ok(Self { times_s, positions_m, rotations })
    }

    /// Where the rig is at a time.
    pub fn pose(&self, time_s: f64) -> Rigid {
        self.motion(time_s).pose
    }

    /// Where the rig is at a time, and how fast.
    pub fn motion(&self, time_s: f64) -> Motion {
        let (Some(&first_s), Some(&last_s)) = (self.times_s.first(), self.times_s.last()) else {
            return Motion {
                pose: Rigid::IDENTITY,
                velocity_m_per_s: DVec3::ZERO,
                angular_velocity_rad_per_s: DVec3::ZERO,
            };
        };
        // `clamp` keeps NaN, which finds no segment; a time that is no number is the start.
        let inside_s = if time_s.is_nan() { first_s } else { time_s.clamp(first_s, last_s) };
        let basis = Basis::at(&self.times_s, inside_s);
        let (position_m, velocity) = curve_position(&basis, &self.positions_m);
        let (rotation, angular_velocity) = curve_rotation(&basis, &self.rotations);
        let moves = if inside_s == time_s { 1.0 } else { 0.0 };
        Motion {
            pose: Rigid { rotation, position_m },
            velocity_m_per_s: velocity * moves,
            angular_velocity_rad_per_s: angular_velocity * moves,
        }
    }

    /// When it starts and ends, seconds.
    pub fn span_s(&self) -> [f64; 2] {
        [self.times_s.first(), self.times_s.last()].map(|time_s| time_s.copied().unwrap_or_default())
    }
}

/// The four control points of the segment.
fn controls<T: Copy>(basis: &Basis, of: &[T]) -> Option<[T; 4]> {
    of.get(basis.segment..basis.segment + 4)?.try_into().ok()
}

fn curve_position(basis: &Basis, positions_m: &[DVec3]) -> (DVec3, DVec3) {
    let Some([first, rest @ ..]) = controls(basis, positions_m) else { return (DVec3::ZERO, DVec3::ZERO) };
    let (mut position, mut velocity, mut last) = (first, DVec3::ZERO, first);
    for ((next, share), rate) in rest.into_iter().zip(basis.cumulative).zip(basis.rate_per_s) {
        position += (next - last) * share;
        velocity += (next - last) * rate;
        last = next;
    }
    (position, velocity)
}

/// The rotation, and the angular velocity by the recursion of Sommer et al., *Efficient Derivative Computation for
/// Cumulative B-Splines on Lie Groups* (CVPR 2020), eq. 38.
fn curve_rotation(basis: &Basis, rotations: &[DQuat]) -> (DQuat, DVec3) {
    let Some([first, rest @ ..]) = controls(basis, rotations) else { return (DQuat::IDENTITY, DVec3::ZERO) };
    let (mut rotation, mut angular_velocity, mut last) = (first, DVec3::ZERO, first);
    for ((next, share), rate) in rest.into_iter().zip(basis.cumulative).zip(basis.rate_per_s) {
        let turn = logarithm(last.conjugate() * next);
        let step = exponential(turn * share);
        rotation *= step;
        angular_velocity = step.conjugate() * angular_velocity + turn * rate;
        last = next;
    }
    (rotation.normalize(), angular_velocity)
}

/// The rotation vector of a unit quaternion, by the shorter way.
pub(crate) fn logarithm(rotation: DQuat) -> DVec3 {
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    let axis = rotation.xyz();
    let sin_half = axis.length();
    // The limit for small angles: atan2(s, w)/s → 1/w.
    if sin_half < 1e-12 { axis * 2.0 } else { axis * (2.0 * sin_half.atan2(rotation.w) / sin_half) }
}

/// The unit quaternion of a rotation vector.
pub(crate) fn exponential(vector: DVec3) -> DQuat {
    DQuat::from_scaled_axis(vector)
}

#[cfg(test)]
mod tests;
