//! How far observed corners are from where a pose puts them: in pixels of the image itself, in units of their errors.

use coshade_lens::model::CameraModel;
use nalgebra::{Isometry3, Matrix6, Point3, SMatrix, SVector, Translation3, Vector2, Vector3, Vector6};

use super::rolling::{RowMotion, RowPose};
use crate::detection::{TagId, TagObservation};
use crate::lie;

/// The corners of one tag in units of their errors.
pub(crate) type Residual = SVector<f64, 8>;
/// Their derivative by the pose.
pub(crate) type Jacobian = SMatrix<f64, 8, 6>;

/// One observed tag, ready for a solver.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    pub tag: TagId,
    /// The corners in the body's frame.
    pub corners_m: [Point3<f64>; 4],
    pub corners_px: [Vector2<f64>; 4],
    /// W with WᵀW = C⁻¹: the inverse of the covariance's Cholesky factor.
    whitening: SMatrix<f64, 8, 8>,
    /// When the row of each corner is exposed, against the frame's stamp.
    pub times_s: [f64; 4],
}

impl Target {
    /// `None` if the covariance is not positive definite and finite.
    pub fn new(observation: &TagObservation, corners_m: [Point3<f64>; 4], times_s: [f64; 4]) -> Option<Self> {
        let TagObservation { tag, corners_px, covariance_px2 } = observation;
        let factor = covariance_px2.cholesky()?.unpack();
        let whitening = factor.solve_lower_triangular(&SMatrix::identity())?;
        let finite = whitening.iter().all(|x| x.is_finite());
        finite.then_some(Self { tag: *tag, corners_m, corners_px: *corners_px, whitening, times_s })
    }
}

/// What turns a pose into corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Imaging<'a> {
    pub lens: &'a CameraModel,
    /// The motion between rows, `None` where all are exposed together.
    pub motion: Option<RowMotion>,
}

/// Imaging at one pose.
pub(crate) struct View<'a> {
    lens: &'a CameraModel,
    camera_from_body: Isometry3<f64>,
    rows: Option<RowPose>,
}

/// About what a pose is turned.
pub(crate) struct Pivot {
    centre: Vector3<f64>,
    /// How what rows' poses depend on changes with the frame's pose.
    unknown_by_pose: Option<Matrix6<f64>>,
}

impl<'a> Imaging<'a> {
    /// With the motion that leads to a pose, for all poses alike.
    pub fn moving_as_at(self, camera_from_body: &Isometry3<f64>) -> Self {
        Self { motion: self.motion.map(|motion| motion.known(camera_from_body)), ..self }
    }

    pub fn at(&self, camera_from_body: &Isometry3<f64>) -> View<'a> {
        let rows = self.motion.as_ref().map(|motion| motion.at(camera_from_body));
        View { lens: self.lens, camera_from_body: *camera_from_body, rows }
    }
}

impl View<'_> {
    /// Observed minus expected corners in pixels; `None` if one is expected outside the lens' field of view.
    pub fn error_px(&self, target: &Target) -> Option<Residual> {
        let mut error = Residual::zeros();
        for (i, corner) in target.corners_m.iter().enumerate() {
            let pose = match &self.rows {
                Some(rows) => rows.pose(target.times_s[i]),
                None => self.camera_from_body,
            };
            let px = self.lens.project(&(pose * corner).coords)?;
            error.fixed_rows_mut::<2>(2 * i).copy_from(&(target.corners_px[i] - px));
        }
        Some(error)
    }

    /// The sum of squares in units of the errors: χ² of one tag. Infinite where [`error_px`](Self::error_px) has none.
    pub fn square(&self, target: &Target) -> f64 {
        self.error_px(target).map_or(f64::INFINITY, |error| (target.whitening * error).norm_squared())
    }

    /// Ready to be [`linearised`](Self::linearised) about a point in the camera's frame.
    pub fn about(&self, centre: &Vector3<f64>) -> Pivot {
        let there = Isometry3::from(Translation3::from(*centre));
        let unknown_by_pose = self.rows.as_ref().map(|rows| rows.unknown_by_pose() * lie::adjoint(&there));
        Pivot { centre: *centre, unknown_by_pose }
    }

    /// The residual W (observed − expected), and its derivative by a twist that turns the body about the pivot's centre
    /// and shifts it: `camera_from_body ← shift(centre) exp(δ) shift(−centre) camera_from_body`.
    pub fn linearised(&self, target: &Target, pivot: &Pivot) -> Option<(Residual, Jacobian)> {
        let mut error = Residual::zeros();
        let mut derivative = Jacobian::zeros();
        for (i, corner) in target.corners_m.iter().enumerate() {
            let moving = self.rows.as_ref().map(|rows| rows.pose_and_derivative(target.times_s[i]));
            let pose = moving.as_ref().map_or(&self.camera_from_body, |(pose, _)| pose);
            // Rows' twists are about the camera.
            let centre = if moving.is_some() { Vector3::zeros() } else { pivot.centre };
            let point = (pose * corner).coords;
            let projected = self.lens.project_jacobian(&point)?;
            error.fixed_rows_mut::<2>(2 * i).copy_from(&(target.corners_px[i] - projected.px));
            for axis in 0..2 {
                let by_shift = projected.d_px_d_point.row(axis).transpose();
                let by_turn = (point - centre).cross(&by_shift);
                let mut by_twist = lie::join(&by_turn, &by_shift);
                if let Some((_, carried)) = &moving {
                    by_twist = carried.tr_mul(&by_twist);
                }
                derivative.set_row(2 * i + axis, &-by_twist.transpose());
            }
        }
        if let Some(unknown_by_pose) = &pivot.unknown_by_pose {
            derivative *= unknown_by_pose;
        }
        Some((target.whitening * error, target.whitening * derivative))
    }
}

/// `camera_from_body` after the twist of [`View::linearised`].
pub(crate) fn disturbed(
    camera_from_body: &Isometry3<f64>,
    centre: &Vector3<f64>,
    twist: &Vector6<f64>,
) -> Isometry3<f64> {
    let there = Translation3::from(*centre);
    let mut pose = there * lie::exp(twist) * there.inverse() * camera_from_body;
    pose.rotation.renormalize();
    pose
}

#[cfg(test)]
mod tests {
    use coshade_lens::model::{CameraModel, ModelKind};

    use super::*;
    use crate::{Family, body::Body};

    #[test]
    fn the_derivative_agrees_with_differences() {
        let lens = CameraModel::from_params(
            ModelKind::KannalaBrandt4,
            &[300.0, 310.0, 320.0, 240.0, 0.02, -0.004, 0.001, 0.0],
        )
        .unwrap();
        let body = Body::single(TagId { family: Family::Tag36h11, id: 3 }, 0.1);
        let pose = lie::exp(&Vector6::new(2.8, 0.3, -0.4, 0.3, -0.2, 0.1));
        let mut covariance = SMatrix::<f64, 8, 8>::identity() * 0.04;
        covariance[(0, 1)] = 0.03;
        covariance[(1, 0)] = 0.03;
        let observation = TagObservation {
            tag: body.tags[0].tag,
            corners_px: [[400.0, 100.0], [380.0, 120.0], [390.0, 90.0], [410.0, 80.0]].map(Vector2::from),
            covariance_px2: covariance,
        };
        let times_s = [-0.01, -0.004, 0.006, 0.012];
        let target = Target::new(&observation, body.tags[0].corners_m(), times_s).unwrap();
        let before = lie::exp(&Vector6::new(0.05, -0.1, 0.2, 0.04, 0.03, -0.02)) * pose;
        let since = RowMotion::Since { before, elapsed_s: 0.03 };
        let centre = pose.translation.vector;
        const STEP: f64 = 1e-6;
        for motion in [None, Some(since), Some(since.known(&pose))] {
            let imaging = Imaging { lens: &lens, motion };
            let linearised = |pose: &Isometry3<f64>| {
                let view = imaging.at(pose);
                view.linearised(&target, &view.about(&centre)).unwrap()
            };
            let (residual, jacobian) = linearised(&pose);
            assert!((residual.norm_squared() / imaging.at(&pose).square(&target) - 1.0).abs() < 1e-12);
            for i in 0..6 {
                let at = |step: f64| {
                    let moved = disturbed(&pose, &centre, &Vector6::ith(i, step));
                    linearised(&moved).0
                };
                let slope = (at(STEP) - at(-STEP)) / (2.0 * STEP);
                // Residuals of some 10³ in units of their errors are rounded to 10⁻¹³, their third derivatives are
                // some 10⁶.
                let error = (jacobian.column(i) - slope).amax() / jacobian.amax();
                assert!(error < 1e-8, "column {i}, {motion:?}: {error:e}");
            }
        }
    }
}
