//! The unknowns of a map, and how far observations are from them.

use coshade_lens::model::CameraModel;
use nalgebra::{DVector, Dyn, Isometry3, OMatrix, Point3, SMatrix, SVector, U8, Vector2, Vector3};

use crate::body::BodyTag;
use crate::detection::{TagId, TagObservation, UNIT_CORNERS};
use crate::lie;
use crate::pose::residuals::disturbed;

/// Unknowns of a tag: a twist about its centre along the map's axes, and the logarithm of its size.
pub(super) const OF_TAG: usize = 7;

#[derive(Clone, Debug)]
pub(super) struct Tag {
    pub tag: TagId,
    pub size_m: f64,
    pub map_from_tag: Isometry3<f64>,
    pub free_pose: bool,
    pub free_size: bool,
}

#[derive(Clone, Debug)]
pub(super) struct Camera {
    pub number: u64,
    pub camera_from_map: Isometry3<f64>,
}

/// A tag in a view.
#[derive(Clone, Debug)]
pub(super) struct Observation {
    pub camera: usize,
    pub tag: usize,
    pub corners_px: [Vector2<f64>; 4],
    pub covariance_px2: SMatrix<f64, 8, 8>,
    /// W with WᵀW = C⁻¹.
    pub whitening: SMatrix<f64, 8, 8>,
}

/// Tags, cameras, lens, and what was seen.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    pub tags: Vec<Tag>,
    pub cameras: Vec<Camera>,
    pub lens: CameraModel,
    pub free_lens: bool,
    pub observations: Vec<Observation>,
}

/// How far one observation is from where it should be.
pub(super) struct ObservationError {
    pub view: usize,
    pub tag: usize,
    pub used: bool,
    /// Of all four corners.
    pub square_px2: f64,
    pub square_rad2: f64,
}

/// A whitened residual and its derivatives by the camera, the tag, and the lens.
pub(super) struct Linear {
    pub residual: SVector<f64, 8>,
    pub by_camera: SMatrix<f64, 8, 6>,
    pub by_tag: SMatrix<f64, 8, OF_TAG>,
    pub by_lens: OMatrix<f64, U8, Dyn>,
}

/// Root mean square distance of corners from sums over four of them.
pub(super) fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 4.0));
    if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
}

impl Observation {
    /// `None` if the tag is not among `tags`, or its covariance is none.
    pub fn new(camera: usize, tags: &[Tag], seen: &TagObservation) -> Option<Self> {
        let tag = tags.iter().position(|own| own.tag == seen.tag)?;
        let mut observation = Self {
            camera,
            tag,
            corners_px: seen.corners_px,
            covariance_px2: seen.covariance_px2,
            whitening: SMatrix::zeros(),
        };
        observation.whitening = observation.whitening_with(0.0)?;
        Some(observation)
    }

    /// As it was seen, with an error beside the stated one, and where its tag is.
    pub fn as_seen(&self, tags: &[Tag], unexplained_px: f64) -> Option<(TagObservation, BodyTag)> {
        let &Tag { tag, size_m, map_from_tag, .. } = tags.get(self.tag)?;
        let covariance_px2 = self.covariance_px2 + SMatrix::identity() * (unexplained_px * unexplained_px);
        let seen = TagObservation { tag, corners_px: self.corners_px, covariance_px2 };
        Some((seen, BodyTag { tag, size_m, body_from_tag: map_from_tag }))
    }

    /// With an error beside the stated one.
    pub fn whitening_with(&self, unexplained_px: f64) -> Option<SMatrix<f64, 8, 8>> {
        let covariance = self.covariance_px2 + SMatrix::identity() * (unexplained_px * unexplained_px);
        let inverse = covariance.cholesky()?.unpack().solve_lower_triangular(&SMatrix::identity())?;
        inverse.iter().all(|x| x.is_finite()).then_some(inverse)
    }
}

impl Problem {
    pub fn new(tags: Vec<Tag>, lens: CameraModel, free_lens: bool) -> Self {
        Self { tags, cameras: Vec::new(), lens, free_lens, observations: Vec::new() }
    }

    /// Unknowns that views share: those of the tags, then those of the lens.
    pub fn shared(&self) -> usize {
        OF_TAG * self.tags.len() + self.of_lens()
    }

    pub fn of_lens(&self) -> usize {
        if self.free_lens { self.lens.params().len() } else { 0 }
    }

    /// Whether each of the shared unknowns is one.
    pub fn free(&self) -> Vec<bool> {
        let of_tag = |tag: &Tag| {
            let mut free = [tag.free_pose; OF_TAG];
            free[6] = tag.free_size;
            free
        };
        let lens = std::iter::repeat_n(true, self.of_lens());
        self.tags.iter().flat_map(of_tag).chain(lens).collect()
    }

    /// Observed minus expected corners in pixels; `None` outside the lens' field of view.
    pub fn error_px(&self, observation: &Observation) -> Option<SVector<f64, 8>> {
        let camera = self.cameras.get(observation.camera)?;
        let tag = self.tags.get(observation.tag)?;
        let mut error = SVector::<f64, 8>::zeros();
        for (i, [x, y]) in UNIT_CORNERS.into_iter().enumerate() {
            let corner = tag.map_from_tag * Point3::new(x * tag.size_m, y * tag.size_m, 0.0);
            let px = self.lens.project(&(camera.camera_from_map * corner).coords)?;
            error.fixed_rows_mut::<2>(2 * i).copy_from(&(observation.corners_px[i] - px));
        }
        Some(error)
    }

    /// χ² of one observation; infinite where it has none.
    pub fn square(&self, observation: &Observation) -> f64 {
        self.error_px(observation)
            .map_or(f64::INFINITY, |error| (observation.whitening * error).norm_squared())
    }

    pub fn squares(&self) -> Vec<f64> {
        self.observations.iter().map(|observation| self.square(observation)).collect()
    }

    pub fn linearised(&self, observation: &Observation) -> Option<Linear> {
        let camera = self.cameras.get(observation.camera)?;
        let tag = self.tags.get(observation.tag)?;
        let turn = camera.camera_from_map.rotation.to_rotation_matrix().into_inner();
        let of_lens = self.of_lens();
        let mut error = SVector::<f64, 8>::zeros();
        let (mut by_camera, mut by_tag) = (SMatrix::<f64, 8, 6>::zeros(), SMatrix::<f64, 8, OF_TAG>::zeros());
        let mut by_lens = OMatrix::<f64, U8, Dyn>::zeros(of_lens);
        for (i, [x, y]) in UNIT_CORNERS.into_iter().enumerate() {
            let arm = tag.map_from_tag.rotation * Vector3::new(x * tag.size_m, y * tag.size_m, 0.0);
            let corner = Point3::from(tag.map_from_tag.translation.vector + arm);
            let point = (camera.camera_from_map * corner).coords;
            let projected = self.lens.project_jacobian(&point)?;
            error.fixed_rows_mut::<2>(2 * i).copy_from(&(observation.corners_px[i] - projected.px));
            for axis in 0..2 {
                let row = 2 * i + axis;
                let by_point = projected.d_px_d_point.row(axis).transpose();
                by_camera.set_row(row, &-lie::join(&point.cross(&by_point), &by_point).transpose());
                let by_corner = turn.tr_mul(&by_point);
                let by_twist = lie::join(&arm.cross(&by_corner), &by_corner);
                by_tag.fixed_view_mut::<1, 6>(row, 0).copy_from(&-by_twist.transpose());
                by_tag[(row, 6)] = -by_corner.dot(&arm);
                for column in 0..of_lens {
                    by_lens[(row, column)] = -projected.d_px_d_params[(axis, column)];
                }
            }
        }
        let whitening = &observation.whitening;
        Some(Linear {
            residual: whitening * error,
            by_camera: whitening * by_camera,
            by_tag: whitening * by_tag,
            by_lens: whitening * by_lens,
        })
    }

    /// After a step; `None` if the lens cannot be that.
    pub fn moved(&self, shared: &DVector<f64>, cameras: &[SVector<f64, 6>]) -> Option<Self> {
        let mut moved = self.clone();
        for (index, tag) in moved.tags.iter_mut().enumerate() {
            let step = shared.fixed_rows::<OF_TAG>(OF_TAG * index);
            let centre = tag.map_from_tag.translation.vector;
            if tag.free_pose {
                tag.map_from_tag =
                    disturbed(&tag.map_from_tag, &centre, &step.fixed_rows::<6>(0).into_owned());
            }
            if tag.free_size {
                tag.size_m *= step[6].exp();
            }
        }
        for (camera, step) in moved.cameras.iter_mut().zip(cameras) {
            camera.camera_from_map = disturbed(&camera.camera_from_map, &Vector3::zeros(), step);
        }
        if self.free_lens {
            let from = OF_TAG * self.tags.len();
            let params = self.lens.params();
            let params: Vec<f64> =
                params.iter().zip(shared.iter().skip(from)).map(|(param, step)| param + step).collect();
            moved.lens = CameraModel::from_params(self.lens.kind(), &params).ok()?;
        }
        Some(moved)
    }

    /// How far all observations are from where they should be.
    pub fn errors(&self, weights: &[f64]) -> Vec<ObservationError> {
        let of = |(observation, weight): (&Observation, &f64)| {
            let error = self.error_px(observation);
            let angle = |(px, error): (&Vector2<f64>, Vector2<f64>)| {
                let (seen, expected) = (self.lens.unproject(px)?, self.lens.unproject(&(px - error))?);
                Some(seen.cross(&expected).norm_squared())
            };
            let angles = error.iter().flat_map(|error| {
                let error = |i: usize| Vector2::new(error[2 * i], error[2 * i + 1]);
                observation.corners_px.iter().enumerate().filter_map(move |(i, px)| angle((px, error(i))))
            });
            ObservationError {
                view: observation.camera,
                tag: observation.tag,
                used: *weight > 0.0,
                square_px2: error.map_or(f64::INFINITY, |error| error.norm_squared()),
                square_rad2: angles.sum(),
            }
        };
        self.observations.iter().zip(weights).map(of).collect()
    }
}
