//! Poses of rows that are exposed one after the other.

use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::lie;

/// How a body moves while rows are exposed.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RowMotion {
    /// With a constant twist from where it was in the frame before, to where it is in this one:
    /// `pose(t) = exp((1 + t/Δt) log(pose · before⁻¹)) · before`, t counted from this frame's stamp.
    Since { before: Isometry3<f64>, elapsed_s: f64 },
    /// With a known twist per `elapsed_s`, wherever it is: `pose(t) = exp(t/Δt ξ) · pose`.
    Known { twist: Vector6<f64>, elapsed_s: f64 },
}

/// A [`RowMotion`] at one pose: `pose(t) = exp((done + t/Δt) ξ) · start`.
pub(crate) struct RowPose {
    motion: RowMotion,
    start: Isometry3<f64>,
    done: f64,
    twist: Vector6<f64>,
    elapsed_s: f64,
}

impl RowMotion {
    pub fn at(&self, camera_from_body: &Isometry3<f64>) -> RowPose {
        let (start, done, twist, elapsed_s) = match *self {
            Self::Since { before, elapsed_s } => {
                (before, 1.0, lie::log(&(camera_from_body * before.inverse())), elapsed_s)
            }
            Self::Known { twist, elapsed_s } => (*camera_from_body, 0.0, twist, elapsed_s),
        };
        RowPose { motion: *self, start, done, twist, elapsed_s }
    }

    /// The motion that ends at a pose, for other poses that are to be compared with it. Both poses of a flat thing move
    /// alike in the image if their twists are the same; but from where the thing was before, one of them would need a
    /// turn that nobody saw.
    pub fn known(&self, camera_from_body: &Isometry3<f64>) -> Self {
        let RowPose { twist, elapsed_s, .. } = self.at(camera_from_body);
        Self::Known { twist, elapsed_s }
    }
}

impl RowPose {
    /// The pose at a time against the frame's stamp.
    pub fn pose(&self, time_s: f64) -> Isometry3<f64> {
        lie::exp(&(self.twist * self.part(time_s))) * self.start
    }

    /// The pose, and how a change of the [unknown](Self::unknown_by_pose) appears as a twist on its left.
    pub fn pose_and_derivative(&self, time_s: f64) -> (Isometry3<f64>, Matrix6<f64>) {
        let part = self.part(time_s);
        let twist = self.twist * part;
        let motion = lie::exp(&twist);
        let derivative = match self.motion {
            RowMotion::Since { .. } => lie::left_jacobian(&twist) * part,
            RowMotion::Known { .. } => lie::adjoint(&motion),
        };
        (motion * self.start, derivative)
    }

    /// How a twist on the left of the frame's pose changes what is unknown: the motion's twist, or the pose itself.
    pub fn unknown_by_pose(&self) -> Matrix6<f64> {
        match self.motion {
            RowMotion::Since { .. } => lie::left_jacobian_inverse(&self.twist),
            RowMotion::Known { .. } => Matrix6::identity(),
        }
    }

    fn part(&self, time_s: f64) -> f64 {
        self.done + time_s / self.elapsed_s
    }
}
