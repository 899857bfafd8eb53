//! A straight line through poses, by weighted least squares.

use nalgebra::Vector6;

use super::Point;

/// Mean of points, and the end at time 0 of the line through them. Variances are in units of the newest point's.
pub(super) struct Line {
    pub(super) mean: Vector6<f64>,
    pub(super) mean_variance: f64,
    pub(super) end: Vector6<f64>,
    pub(super) end_variance: f64,
}

impl Line {
    /// The line through points of different times; of a single point, the point.
    pub(super) fn through(points: &[Point]) -> Self {
        let (mut weight, mut time, mut mean) = (0.0, 0.0, Vector6::zeros());
        for point in points {
            weight += point.weight;
            time += point.weight * point.time_s;
            mean += point.place * point.weight;
        }
        time /= weight;
        mean /= weight;
        let (mut spread, mut slope) = (0.0, Vector6::zeros());
        for point in points {
            let lever = point.weight * (point.time_s - time);
            spread += lever * (point.time_s - time);
            slope += point.place * lever;
        }
        let mean_variance = 1.0 / weight;
        if points.len() < 2 {
            return Self { mean, mean_variance, end: mean, end_variance: mean_variance };
        }
        Self {
            mean,
            mean_variance,
            end: mean - slope * (time / spread),
            end_variance: mean_variance + time * time / spread,
        }
    }
}
