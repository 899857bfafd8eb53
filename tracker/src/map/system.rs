//! One step of the adjustment: normal equations, from which the views are eliminated one by one (Schur's complement), so
//! that what is left grows with the tags only.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, OMatrix, SMatrix, SVector, U6, U8};

use super::problem::{OF_TAG, Problem};

/// The sum of squares around the unknowns, to second order.
pub(super) struct System {
    pub chi2: f64,
    /// Second derivative by the shared unknowns, views not eliminated.
    shared: DMatrix<f64>,
    gradient: DVector<f64>,
    views: Vec<ViewSystem>,
    free: Vec<bool>,
}

/// Second derivatives by shared unknowns and those of a view.
type Mixed = OMatrix<f64, Dyn, U6>;

/// What one view adds.
struct ViewSystem {
    /// Which of the shared unknowns it depends on.
    columns: Vec<usize>,
    own: SMatrix<f64, 6, 6>,
    gradient: SVector<f64, 6>,
    /// A row for each of `columns`.
    mixed: Mixed,
    is_used: bool,
}

/// A step, and by how much χ² should fall.
pub(super) struct Step {
    pub shared: DVector<f64>,
    pub cameras: Vec<SVector<f64, 6>>,
    pub promised: f64,
}

impl System {
    /// `None` if an observation that is used is outside the lens' field of view.
    pub fn new(problem: &Problem, weights: &[f64]) -> Option<Self> {
        let size = problem.shared();
        let mut system = Self {
            chi2: 0.0,
            shared: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
            views: problem.cameras.iter().map(|_| ViewSystem::empty()).collect(),
            free: problem.free(),
        };
        let lens = OF_TAG * problem.tags.len()..size;
        for (observation, &weight) in problem.observations.iter().zip(weights).filter(|(_, w)| **w > 0.0) {
            let linear = problem.linearised(observation)?;
            system.chi2 += weight * linear.residual.norm_squared();
            let mut by_shared = OMatrix::<f64, U8, Dyn>::zeros(OF_TAG + lens.len());
            by_shared.columns_mut(0, OF_TAG).copy_from(&linear.by_tag);
            by_shared.columns_mut(OF_TAG, lens.len()).copy_from(&linear.by_lens);
            let first = OF_TAG * observation.tag;
            let columns: Vec<usize> = (first..first + OF_TAG).chain(lens.clone()).collect();
            for (local, &column) in columns.iter().enumerate() {
                if system.free.get(column) != Some(&true) {
                    by_shared.column_mut(local).fill(0.0);
                }
            }
            let hessian = by_shared.tr_mul(&by_shared) * weight;
            let gradient = by_shared.tr_mul(&linear.residual) * weight;
            for (i, &row) in columns.iter().enumerate() {
                system.gradient[row] += gradient[i];
                for (j, &column) in columns.iter().enumerate() {
                    system.shared[(row, column)] += hessian[(i, j)];
                }
            }
            let view = system.views.get_mut(observation.camera)?;
            view.own += linear.by_camera.tr_mul(&linear.by_camera) * weight;
            view.gradient += linear.by_camera.tr_mul(&linear.residual) * weight;
            view.add_mixed(&columns, &(by_shared.tr_mul(&linear.by_camera) * weight));
            view.is_used = true;
        }
        system.chi2.is_finite().then_some(system)
    }

    /// What is left for the shared unknowns, with damped diagonals.
    fn reduced(&self, damping: f64) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (mut matrix, mut gradient) = (self.shared.clone(), self.gradient.clone());
        for i in 0..matrix.nrows() {
            matrix[(i, i)] *= 1.0 + damping;
            if self.free.get(i) != Some(&true) {
                matrix[(i, i)] = 1.0;
            }
        }
        for view in self.views.iter().filter(|view| view.is_used) {
            let factor = view.damped(damping).cholesky()?;
            let eliminated = factor.solve(&view.mixed.transpose());
            let less = &view.mixed * &eliminated;
            let less_gradient = eliminated.tr_mul(&view.gradient);
            for (i, &row) in view.columns.iter().enumerate() {
                gradient[row] -= less_gradient[i];
                for (j, &column) in view.columns.iter().enumerate() {
                    matrix[(row, column)] -= less[(i, j)];
                }
            }
        }
        Some((matrix, gradient))
    }

    /// A step of Levenberg and Marquardt; `None` if the unknowns are not determined.
    pub fn step(&self, damping: f64) -> Option<Step> {
        let (matrix, gradient) = self.reduced(damping)?;
        let shared = -scaled_cholesky(&matrix)?.solve(&gradient);
        let mut promised = -shared.dot(&self.gradient);
        let mut cameras = Vec::with_capacity(self.views.len());
        for view in &self.views {
            if !view.is_used {
                cameras.push(SVector::zeros());
                continue;
            }
            let local = DVector::from_iterator(view.columns.len(), view.columns.iter().map(|&i| shared[i]));
            let right = view.gradient + view.mixed.tr_mul(&local);
            let step = -view.damped(damping).cholesky()?.solve(&right);
            promised -= step.dot(&view.gradient);
            cameras.push(step);
        }
        Some(Step { shared, cameras, promised })
    }

    /// The covariance of the shared unknowns; 0 for those that are none. `None` if they are not determined.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let (matrix, _) = self.reduced(0.0)?;
        let mut covariance = scaled_cholesky(&matrix)?.inverse();
        for (i, _) in self.free.iter().enumerate().filter(|(_, free)| !**free) {
            covariance.row_mut(i).fill(0.0);
            covariance.column_mut(i).fill(0.0);
        }
        Some(covariance)
    }
}

/// A factor of a matrix whose diagonal was scaled to 1, so that unknowns of different units are told from undetermined ones.
struct Scaled {
    factor: Cholesky<f64, Dyn>,
    scale: DVector<f64>,
}

/// Pivots below this share of an unknown's own information mean that others take its place.
const UNDETERMINED: f64 = 1e-13;

fn scaled_cholesky(matrix: &DMatrix<f64>) -> Option<Scaled> {
    let scale = matrix.diagonal().map(|x| 1.0 / x.sqrt());
    if !scale.iter().all(|x| x.is_finite() && *x > 0.0) {
        return None;
    }
    let scaled =
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let factor = scaled.cholesky()?;
    let determined = factor.l_dirty().diagonal().iter().all(|pivot| pivot * pivot > UNDETERMINED);
    determined.then_some(Scaled { factor, scale })
}

impl Scaled {
    fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        self.factor.solve(&right.component_mul(&self.scale)).component_mul(&self.scale)
    }

    fn inverse(&self) -> DMatrix<f64> {
        let inverse = self.factor.inverse();
        DMatrix::from_fn(inverse.nrows(), inverse.ncols(), |i, j| {
            inverse[(i, j)] * self.scale[i] * self.scale[j]
        })
    }
}

impl ViewSystem {
    fn empty() -> Self {
        Self {
            columns: Vec::new(),
            own: SMatrix::zeros(),
            gradient: SVector::zeros(),
            mixed: Mixed::zeros(0),
            is_used: false,
        }
    }

    fn damped(&self, damping: f64) -> SMatrix<f64, 6, 6> {
        let mut own = self.own;
        own.set_diagonal(&(self.own.diagonal() * (1.0 + damping)));
        own
    }

    fn add_mixed(&mut self, columns: &[usize], mixed: &Mixed) {
        for (local, &column) in columns.iter().enumerate() {
            let row = self.columns.iter().position(|own| *own == column).unwrap_or_else(|| {
                self.columns.push(column);
                let rows = self.mixed.nrows();
                self.mixed = std::mem::replace(&mut self.mixed, Mixed::zeros(0)).insert_row(rows, 0.0);
                rows
            });
            let mut own = self.mixed.row_mut(row);
            own += mixed.row(local);
        }
    }
}

#[cfg(test)]
mod tests {
    use coshade_lens::model::{CameraModel, ModelKind};
    use nalgebra::{Isometry3, Vector6};

    use super::super::problem::{Camera, Observation, Tag};
    use super::*;
    use crate::detection::{TagId, TagObservation};
    use crate::{Family, lie};

    fn problem() -> Problem {
        let params = [400.0, 410.0, 320.0, 240.0, -0.1, 0.02, 0.001, -0.002, 0.01];
        let lens = CameraModel::from_params(ModelKind::BrownConrady5, &params).unwrap();
        let tag = |id: u32, free: bool| Tag {
            tag: TagId { family: Family::Tag36h11, id },
            size_m: 0.1 + 0.01 * f64::from(id),
            map_from_tag: lie::exp(&(Vector6::new(0.2, -0.3, 0.1, 0.15, 0.05, 0.02) * f64::from(id))),
            free_pose: free,
            free_size: free,
        };
        let mut problem = Problem::new(vec![tag(0, false), tag(1, true), tag(2, true)], lens, true);
        for number in 0..6_u32 {
            let turn = 0.15 * (f64::from(number) - 2.5);
            let away = Isometry3::translation(-0.1, 0.02 * f64::from(number), 0.8);
            let camera_from_map = away * lie::exp(&Vector6::new(2.9, turn, 0.3 * turn, 0.0, 0.0, 0.0));
            let camera = problem.cameras.len();
            problem.cameras.push(Camera { number: number.into(), camera_from_map });
            for tag in problem.tags.clone() {
                let mut covariance_px2 = SMatrix::identity() * 0.04;
                (covariance_px2[(0, 1)], covariance_px2[(1, 0)]) = (0.02, 0.02);
                let seen = TagObservation { tag: tag.tag, corners_px: Default::default(), covariance_px2 };
                let mut own = Observation::new(camera, &problem.tags, &seen).unwrap();
                let expected = -problem.error_px(&own).unwrap();
                own.corners_px = std::array::from_fn(|i| {
                    expected.fixed_rows::<2>(2 * i) + nalgebra::Vector2::new(0.3, -0.2) * i as f64
                });
                problem.observations.push(own);
            }
        }
        problem
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let problem = problem();
        const STEP: f64 = 1e-6;
        let none = vec![SVector::zeros(); problem.cameras.len()];
        for observation in &problem.observations {
            let linear = problem.linearised(observation).unwrap();
            let residual = |moved: Problem| observation.whitening * moved.error_px(observation).unwrap();
            let check = |derivative: SVector<f64, 8>, at: &dyn Fn(f64) -> Problem, step: f64| {
                let slope = (residual(at(step)) - residual(at(-step))) / (2.0 * step);
                let error = (derivative - slope).amax() / derivative.amax().max(1.0);
                // Residuals near 10³ are rounded to 10⁻¹³ of a step of 10⁻⁶.
                assert!(error < 1e-6, "{error:e}");
            };
            for i in 0..6 {
                let at = |step: f64| {
                    let mut cameras = none.clone();
                    cameras[observation.camera][i] = step;
                    problem.moved(&DVector::zeros(problem.shared()), &cameras).unwrap()
                };
                check(linear.by_camera.column(i).into_owned(), &at, STEP);
            }
            let shared = |i: usize| {
                let (problem, none) = (&problem, &none);
                move |step: f64| {
                    let mut shared = DVector::zeros(problem.shared());
                    shared[i] = step;
                    problem.moved(&shared, none).unwrap()
                }
            };
            if observation.tag > 0 {
                for i in 0..OF_TAG {
                    check(linear.by_tag.column(i).into_owned(), &shared(OF_TAG * observation.tag + i), STEP);
                }
            }
            for i in 0..problem.of_lens() {
                let column = linear.by_lens.fixed_view::<8, 1>(0, i).into_owned();
                check(column, &shared(OF_TAG * problem.tags.len() + i), STEP);
            }
        }
    }

    #[test]
    fn eliminating_the_views_changes_nothing() {
        let problem = problem();
        let weights = vec![0.7; problem.observations.len()];
        let system = System::new(&problem, &weights).unwrap();
        // The whole system, views last.
        let (shared, all) = (problem.shared(), problem.shared() + 6 * problem.cameras.len());
        let (mut matrix, mut gradient) = (DMatrix::zeros(all, all), DVector::zeros(all));
        for observation in &problem.observations {
            let linear = problem.linearised(observation).unwrap();
            let mut row = DMatrix::zeros(8, all);
            row.view_mut((0, OF_TAG * observation.tag), (8, OF_TAG)).copy_from(&linear.by_tag);
            row.view_mut((0, shared - problem.of_lens()), (8, problem.of_lens())).copy_from(&linear.by_lens);
            row.view_mut((0, shared + 6 * observation.camera), (8, 6)).copy_from(&linear.by_camera);
            row.columns_mut(0, OF_TAG).fill(0.0);
            matrix += row.tr_mul(&row) * 0.7;
            gradient += row.tr_mul(&linear.residual) * 0.7;
        }
        for i in 0..OF_TAG {
            matrix[(i, i)] = 1.0;
        }
        let damping = 1e-3;
        let mut damped = matrix.clone();
        for i in OF_TAG..all {
            damped[(i, i)] *= 1.0 + damping;
        }
        let expected = -damped.cholesky().unwrap().solve(&gradient);
        let step = system.step(damping).unwrap();
        let scale = matrix.diagonal().map(f64::sqrt);
        for i in 0..shared {
            assert!(((step.shared[i] - expected[i]) * scale[i]).abs() < 1e-6, "{i}");
        }
        for (view, own) in step.cameras.iter().enumerate() {
            for i in 0..6 {
                let at = shared + 6 * view + i;
                assert!(((own[i] - expected[at]) * scale[at]).abs() < 1e-6, "view {view}, {i}");
            }
        }
        let inverse = matrix.cholesky().unwrap().inverse();
        let covariance = system.covariance().unwrap();
        for i in OF_TAG..shared {
            assert!((covariance[(i, i)] / inverse[(i, i)] - 1.0).abs() < 1e-6, "{i}");
        }
    }
}
