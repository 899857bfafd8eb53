//! The least-squares fit of a blurred tag to the pixels of an image.

use nalgebra::{DMatrixView, Matrix2, Matrix3, SMatrix, SVector, Vector2};

use super::chart::{Chart, homography, is_front};
use super::template::Template;
use super::{RefineError, Sample, Stage};

/// Unknowns: 8 of the homography, the logarithm of the blur, 7 of light.
const UNKNOWNS: usize = 16;
/// Index of the blur, and of the first unknown of light.
const BLUR: usize = 8;
const LIGHT: usize = 9;

/// What is usual for the blur, in px, and by which factor it may be off: keeps the fit of tiny tags in bounds.
const USUAL_BLUR_PX: f64 = 0.7;
const USUAL_BLUR_FACTOR: f64 = 2.0;
/// Light gradients across a tag, and the curvature of the response, as fractions of its contrast.
const USUAL_GRADIENT: f64 = 0.3;
const USUAL_CURVATURE: f64 = 0.2;
/// Tukey's biweight: 95 % efficient for normal errors.
const TUKEY: f64 = 4.685;
/// Deviations below this fraction of the contrast are never taken for something in front of the tag.
pub(super) const TOLERATED: f64 = 0.03;

/// Corners that move by less in a step are about to settle, in px.
const SETTLING_PX: f64 = 0.15;

type Normal = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
type Unknowns = SVector<f64, UNKNOWNS>;
/// Unknowns and deviation.
const COLUMNS: usize = UNKNOWNS + 1;
type Square = SMatrix<f64, COLUMNS, COLUMNS>;

/// The state of a fit.
#[derive(Clone, Debug)]
pub(super) struct Fit<'a> {
    template: &'a Template,
    chart: &'a Chart<'a>,
    cells_from_chart: Matrix3<f64>,
    log_blur: f64,
    /// Black, its gradients; white above black, its gradients; curvature.
    light: SVector<f64, 7>,
    /// Standard deviation of the pixels' light, as far as it is known.
    noise: Option<f64>,
    /// Deviations from which on a pixel shows something else than the tag.
    scale: f64,
    iterations: u32,
}

/// Sums over the pixels.
pub(super) struct Sums {
    normal: Normal,
    gradient: Unknowns,
    weight: f64,
    weighted_square: f64,
}

impl Sums {
    /// Of the pixels' light, above 0.
    fn variance(&self) -> f64 {
        (self.weighted_square / (self.weight - UNKNOWNS as f64).max(1.0)).max(1e-3)
    }
}

/// Memory that fits use again and again.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// Of each pixel that counts: the derivative of its light by the unknowns, and its deviation, times the root of its
    /// weight.
    rows: Vec<f64>,
    /// Of all pixels.
    deviations: Vec<f64>,
}

/// What a fit has found.
pub(super) struct Fitted {
    pub(super) corners_px: [Vector2<f64>; 4],
    pub(super) covariance_px2: SMatrix<f64, 8, 8>,
    pub(super) blur_px: f64,
    pub(super) contrast: f64,
    pub(super) residual: f64,
    pub(super) explained: f64,
    pub(super) iterations: u32,
}

impl<'a> Fit<'a> {
    /// Starts from corners that are right to about a cell.
    pub(super) fn start(
        template: &'a Template,
        chart: &'a Chart<'a>,
        corners_px: &[Vector2<f64>; 4],
        blur_px: f64,
    ) -> Option<Self> {
        let mut places = [Vector2::zeros(); 4];
        for (place, px) in places.iter_mut().zip(corners_px) {
            *place = chart.place(px)?;
        }
        let cells_from_chart = homography(&places, &template.corners())?;
        Some(Self {
            template,
            chart,
            cells_from_chart,
            log_blur: blur_px.ln(),
            light: SVector::zeros(),
            noise: None,
            scale: f64::INFINITY,
            iterations: 0,
        })
    }

    /// Column and row of cells at a place of the chart, with their derivatives by it.
    pub(super) fn cell(&self, place: &Vector2<f64>) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let h = &self.cells_from_chart;
        let w = h.m31 * place.x + h.m32 * place.y + h.m33;
        if w < 1e-3 {
            return None;
        }
        let cell = Vector2::new(
            (h.m11 * place.x + h.m12 * place.y + h.m13) / w,
            (h.m21 * place.x + h.m22 * place.y + h.m23) / w,
        );
        let by_place = Matrix2::new(
            h.m11 - cell.x * h.m31,
            h.m12 - cell.x * h.m32,
            h.m21 - cell.y * h.m31,
            h.m22 - cell.y * h.m32,
        ) / w;
        Some((cell, by_place))
    }

    pub(super) fn template(&self) -> &'a Template {
        self.template
    }

    /// How far corners may be from where they were looked for: a cell, or two pixels.
    fn reach_px(&self, corners: &[Vector2<f64>; 4]) -> f64 {
        let [a, b, c, d] = corners;
        let longest =
            [(a, b), (b, c), (c, d), (d, a)].iter().map(|(a, b)| (*a - *b).norm()).fold(0.0, f64::max);
        (longest / self.template.width()).max(2.0)
    }

    pub(super) fn blur_px(&self) -> f64 {
        self.log_blur.exp()
    }

    /// White minus black, in standard deviations of the noise; 0 before the first fit.
    pub(super) fn contrast_to_noise(&self) -> f64 {
        self.noise.map_or(0.0, |noise| self.light[3] / noise)
    }

    /// Fits to the samples.
    pub(super) fn run(
        &mut self,
        samples: &[Sample],
        stage: &Stage,
        scratch: &mut Scratch,
    ) -> Result<Sums, RefineError> {
        let mut tolerated = stage.tolerated;
        if self.noise.is_none() {
            self.start_light(samples).ok_or(RefineError::Flat)?;
            self.scale = tolerated * self.light[3];
        }
        let start = self.corners_px().ok_or(RefineError::Lost)?;
        let mut corners = start;
        let mut sums;
        loop {
            self.iterations += 1;
            sums = self.sums(samples, scratch);
            self.add_prior(&mut sums);
            let step = sums.normal.cholesky().ok_or(RefineError::Flat)?.solve(&sums.gradient);
            self.apply(&(step * limit(&step)));
            let moved = self.corners_px().ok_or(RefineError::Lost)?;
            let shift = distance(&moved, &corners);
            corners = moved;
            if !shift.is_finite() || distance(&corners, &start) > self.reach_px(&start) {
                return Err(RefineError::Lost);
            }
            let settled = tolerated <= TOLERATED && shift < stage.converged_px;
            if settled || self.iterations >= stage.max_iterations {
                break;
            }
            // While corners still move, what deviates is not yet something else than the tag.
            if shift < SETTLING_PX {
                tolerated = (0.5 * tolerated).max(TOLERATED);
            }
            self.scale =
                (1.4826 * median(&mut scratch.deviations)).max(tolerated * self.light[3].abs()).max(0.5);
        }
        if self.light[3] <= 0.0 || !is_front(&corners) {
            return Err(RefineError::Lost);
        }
        self.noise = Some(sums.variance().sqrt().max(0.3));
        Ok(sums)
    }

    /// Corners and their covariance, from the sums of the last step.
    pub(super) fn finish(
        &self,
        sums: &Sums,
        samples: &[Sample],
        scratch: &Scratch,
    ) -> Result<Fitted, RefineError> {
        let variance = sums.variance();
        let inverse = sums.normal.cholesky().ok_or(RefineError::Flat)?.inverse();
        let of_homography = inverse.fixed_view::<8, 8>(0, 0) * variance;
        let by_unknowns = self.corners_by_homography().ok_or(RefineError::Lost)?;
        let covariance_px2 = by_unknowns * of_homography * by_unknowns.transpose();
        let mean = samples.iter().map(|sample| sample.light).sum::<f64>() / samples.len() as f64;
        let total = samples.iter().map(|sample| (sample.light - mean).powi(2)).sum::<f64>();
        let left = scratch.deviations.iter().map(|deviation| deviation * deviation).sum::<f64>();
        Ok(Fitted {
            corners_px: self.corners_px().ok_or(RefineError::Lost)?,
            covariance_px2,
            blur_px: self.blur_px(),
            contrast: self.light[3],
            residual: variance.sqrt(),
            explained: 1.0 - left / total.max(1e-9),
            iterations: self.iterations,
        })
    }

    /// Black and white by linear regression of light on the template.
    fn start_light(&mut self, samples: &[Sample]) -> Option<()> {
        let (mut n, mut t, mut tt, mut l, mut tl) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for sample in samples {
            let (cell, by_place) = self.cell(&sample.place)?;
            let value = self.template.shade(cell, &self.covariance(&(by_place * sample.by_px))).value;
            n += 1.0;
            t += value;
            tt += value * value;
            l += sample.light;
            tl += value * sample.light;
        }
        let variance = tt / n - (t / n).powi(2);
        if variance.is_nan() || variance < 1e-6 {
            return None;
        }
        let contrast = (tl / n - t / n * l / n) / variance;
        self.light[0] = l / n - contrast * t / n;
        self.light[3] = contrast.max(1.0);
        Some(())
    }

    /// Covariance of the blur in cells, from ∂cell/∂px.
    fn covariance(&self, by_px: &Matrix2<f64>) -> Matrix2<f64> {
        by_px * by_px.transpose() * (2.0 * self.log_blur).exp()
    }

    fn sums(&self, samples: &[Sample], scratch: &mut Scratch) -> Sums {
        scratch.rows.clear();
        scratch.deviations.clear();
        let mut weight_sum = 0.0;
        let middle = 0.5 * self.template.side();
        for sample in samples {
            let Some((cell, by_place)) = self.cell(&sample.place) else { continue };
            let shade = self.template.shade(cell, &self.covariance(&(by_place * sample.by_px)));
            let (u, v, t) = ((cell.x - middle) / middle, (cell.y - middle) / middle, shade.value);
            let light = [1.0, u, v, t, u * t, v * t, t * (1.0 - t)];
            let predicted: f64 = self.light.iter().zip(light).map(|(unknown, factor)| unknown * factor).sum();
            // Both beyond white: the code says no more than that.
            if sample.clipped && predicted > sample.light {
                continue;
            }
            let deviation = sample.light - predicted;
            scratch.deviations.push(deviation);
            let weight = sample.weight * tukey(deviation / (TUKEY * self.scale));
            if weight <= 0.0 {
                continue;
            }
            weight_sum += weight;
            let root = weight.sqrt();
            let by_t =
                self.light[3] + self.light[4] * u + self.light[5] * v + self.light[6] * (1.0 - 2.0 * t);
            let by_homography = self.by_homography(&sample.place, &cell, &(shade.gradient * (by_t * root)));
            scratch.rows.extend_from_slice(&by_homography);
            scratch.rows.push(root * by_t * shade.by_log_blur);
            scratch.rows.extend(light.map(|factor| root * factor));
            scratch.rows.push(root * deviation);
        }
        let square = square(&scratch.rows);
        Sums {
            normal: square.fixed_view::<UNKNOWNS, UNKNOWNS>(0, 0).into_owned(),
            gradient: square.fixed_view::<UNKNOWNS, 1>(0, UNKNOWNS).into_owned(),
            weight: weight_sum,
            weighted_square: square[(UNKNOWNS, UNKNOWNS)],
        }
    }

    /// The derivative of light by the homography, from its gradient per cell.
    fn by_homography(
        &self,
        place: &Vector2<f64>,
        cell: &Vector2<f64>,
        gradient: &Vector2<f64>,
    ) -> [f64; BLUR] {
        let h = &self.cells_from_chart;
        let (x, y) = (place.x, place.y);
        let w = 1.0 / (h.m31 * x + h.m32 * y + h.m33);
        let (gx, gy, gw) = (gradient.x * w, gradient.y * w, -gradient.dot(cell) * w);
        [gx * x, gx * y, gx, gy * x, gy * y, gy, gw * x, gw * y]
    }

    /// What is usual for blur and light, weighed as the noise weighs the pixels.
    fn add_prior(&self, sums: &mut Sums) {
        let variance = sums.variance();
        let contrast = self.light[3].abs().max(1.0);
        let mut add = |index: usize, deviation: f64, sigma: f64| {
            let weight = variance / (sigma * sigma);
            sums.normal[(index, index)] += weight;
            sums.gradient[index] += weight * deviation;
        };
        add(BLUR, USUAL_BLUR_PX.ln() - self.log_blur, USUAL_BLUR_FACTOR.ln());
        for index in [1, 2, 4, 5] {
            add(LIGHT + index, -self.light[index], USUAL_GRADIENT * contrast);
        }
        add(LIGHT + 6, -self.light[6], USUAL_CURVATURE * contrast);
    }

    fn apply(&mut self, step: &Unknowns) {
        let h = &mut self.cells_from_chart;
        for (entry, change) in
            [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1)].iter().zip(step.iter())
        {
            h[*entry] += change;
        }
        self.log_blur = (self.log_blur + step[BLUR]).clamp(0.2_f64.ln(), 8.0_f64.ln());
        self.light += step.fixed_rows::<7>(LIGHT);
    }

    pub(super) fn chart_from_cells(&self) -> Option<Matrix3<f64>> {
        self.cells_from_chart.try_inverse()
    }

    fn corner_places(&self) -> Option<[Vector2<f64>; 4]> {
        let chart_from_cells = self.chart_from_cells()?;
        let mut places = [Vector2::zeros(); 4];
        for (place, cell) in places.iter_mut().zip(self.template.corners()) {
            let point = chart_from_cells * cell.push(1.0);
            *place = (point.z.abs() > 1e-12).then(|| point.xy() / point.z)?;
        }
        Some(places)
    }

    fn corners_px(&self) -> Option<[Vector2<f64>; 4]> {
        let mut corners = [Vector2::zeros(); 4];
        for (corner, place) in corners.iter_mut().zip(self.corner_places()?) {
            *corner = self.chart.in_image(&place)?.px;
        }
        Some(corners)
    }

    /// ∂corners/∂homography: a corner stays on its cell, so what the cell moves, its place moves back.
    fn corners_by_homography(&self) -> Option<SMatrix<f64, 8, 8>> {
        let mut all = SMatrix::<f64, 8, 8>::zeros();
        for (index, place) in self.corner_places()?.iter().enumerate() {
            let (cell, by_place) = self.cell(place)?;
            let h = &self.cells_from_chart;
            let w = 1.0 / (h.m31 * place.x + h.m32 * place.y + h.m33);
            let (x, y) = (place.x * w, place.y * w);
            let cell_by_homography = SMatrix::<f64, 2, 8>::from_row_slice(&[
                x,
                y,
                w,
                0.0,
                0.0,
                0.0,
                -cell.x * x,
                -cell.x * y, //
                0.0,
                0.0,
                0.0,
                x,
                y,
                w,
                -cell.y * x,
                -cell.y * y,
            ]);
            let px_by_cell = self.chart.in_image(place)?.by_place * by_place.try_inverse()?;
            all.fixed_view_mut::<2, 8>(2 * index, 0).copy_from(&(-px_by_cell * cell_by_homography));
        }
        Some(all)
    }
}

/// Factor that keeps a step within what the linearisation is good for: half a factor of e of blur.
fn limit(step: &Unknowns) -> f64 {
    (0.5 / step[BLUR].abs().max(1e-9)).min(1.0)
}

/// Rᵀ R of the rows R, as a matrix product: that is vector code on any processor.
fn square(rows: &[f64]) -> Square {
    let count = rows.len() / COLUMNS;
    let mut square = Square::zeros();
    if count > 0 {
        let columns = DMatrixView::from_slice(rows, COLUMNS, count);
        let transposed = DMatrixView::from_slice_with_strides(rows, count, COLUMNS, COLUMNS, 1);
        square.gemm(1.0, &columns, &transposed, 0.0);
    }
    square
}

/// Tukey's biweight of a deviation that is cut off at 1.
#[inline]
fn tukey(deviation: f64) -> f64 {
    let inside = 1.0 - deviation * deviation;
    if inside > 0.0 { inside * inside } else { 0.0 }
}

fn median(deviations: &mut [f64]) -> f64 {
    deviations.iter_mut().for_each(|deviation| *deviation = deviation.abs());
    let middle = deviations.len() / 2;
    match deviations.is_empty() {
        true => 0.0,
        false => *deviations.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

/// Largest distance between corners.
fn distance(a: &[Vector2<f64>; 4], b: &[Vector2<f64>; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}
