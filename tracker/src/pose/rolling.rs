//! Poses of rows that are exposed one after the other.

use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::lie;

/// A body that moves with a constant twist from where it was in the frame before, to where it is in this one:
/// `pose(t) = exp(t/Δt · log(pose · before⁻¹)) · pose`, t counted from this frame's stamp.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowMotion {
    before_inverse: Isometry3<f64>,
    elapsed_s: f64,
}

/// A [`RowMotion`] that ends at one pose.
pub(crate) struct RowPose {
    camera_from_body: Isometry3<f64>,
    /// From the frame before to this one.
    twist: Vector6<f64>,
    /// How the twist changes with the pose.
    twist_by_pose: Matrix6<f64>,
    elapsed_s: f64,
}

impl RowMotion {
    pub fn new(camera_from_body_before: &Isometry3<f64>, elapsed_s: f64) -> Self {
        Self { before_inverse: camera_from_body_before.inverse(), elapsed_s }
    }

    pub fn at(&self, camera_from_body: &Isometry3<f64>) -> RowPose {
        let twist = lie::log(&(camera_from_body * self.before_inverse));
        let twist_by_pose = lie::left_jacobian_inverse(&twist);
        RowPose { camera_from_body: *camera_from_body, twist, twist_by_pose, elapsed_s: self.elapsed_s }
    }
}

impl RowPose {
    /// The pose at a time against the frame's stamp.
    pub fn pose(&self, time_s: f64) -> Isometry3<f64> {
        lie::exp(&(self.twist * (time_s / self.elapsed_s))) * self.camera_from_body
    }

    /// The pose, and how a twist on the left of the frame's pose appears on its left: with a = t/Δt and ξ the twist,
    /// `a J(aξ) J⁻¹(ξ) + adjoint(exp(aξ))`, J the left Jacobian.
    pub fn pose_and_derivative(&self, time_s: f64) -> (Isometry3<f64>, Matrix6<f64>) {
        let part = time_s / self.elapsed_s;
        let twist = self.twist * part;
        let motion = lie::exp(&twist);
        let derivative = lie::left_jacobian(&twist) * self.twist_by_pose * part + lie::adjoint(&motion);
        (motion * self.camera_from_body, derivative)
    }
}
