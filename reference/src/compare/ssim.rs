//! Structural similarity: Z. Wang et al., "Image Quality Assessment: From Error Visibility to Structural Similarity",
//! IEEE TIP 13(4), 2004, eq. 13, with the paper's Gaussian window (11×11, σ = 1.5), K1 = 0.01, K2 = 0.03, L = 1.
//!
//! The same as scikit-image's `structural_similarity(a, b, gaussian_weights=True, sigma=1.5,
//! use_sample_covariance=False, data_range=1, channel_axis=-1)`: per channel, averaged over channels; windows that
//! reach beyond the image do not count.

use rayon::prelude::*;

use super::plane::{Grid, convolve_separable};

/// Pixels between the image's border and the first window centre.
pub(super) const RADIUS_PX: usize = 5;
const SIGMA_PX: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// SSIM of every window, by its centre, averaged over the channels of code values in [0, 1].
///
/// Centres nearer than [`RADIUS_PX`] to the border hold `None`.
pub(super) fn ssim_map(a: &[Vec<f32>], b: &[Vec<f32>], grid: Grid) -> Vec<Option<f64>> {
    let kernel = gaussian();
    let per_channel: Vec<Vec<f64>> = a.iter().zip(b).map(|(a, b)| channel_map(a, b, grid, &kernel)).collect();
    let inside = |index: usize| {
        let (x, y) = (index % grid.width, index / grid.width);
        x >= RADIUS_PX && y >= RADIUS_PX && x + RADIUS_PX < grid.width && y + RADIUS_PX < grid.height
    };
    let mean = |index: usize| {
        let sum: f64 = per_channel.iter().filter_map(|map| map.get(index)).sum();
        sum / per_channel.len() as f64
    };
    (0..grid.pixels()).map(|index| inside(index).then(|| mean(index))).collect()
}

fn gaussian() -> Vec<f64> {
    let radius = RADIUS_PX as i32;
    let weights: Vec<f64> =
        (-radius..=radius).map(|x| (-0.5 * (f64::from(x) / SIGMA_PX).powi(2)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

fn channel_map(a: &[f32], b: &[f32], grid: Grid, kernel: &[f64]) -> Vec<f64> {
    let product = |f: fn(f64, f64) -> f64| -> Vec<f64> {
        let values: Vec<f64> = a.par_iter().zip(b).map(|(&a, &b)| f(f64::from(a), f64::from(b))).collect();
        convolve_separable(&values, grid, kernel, kernel)
    };
    let (mean_a, mean_b) = (product(|a, _| a), product(|_, b| b));
    let (aa, bb, ab) = (product(|a, _| a * a), product(|_, b| b * b), product(|a, b| a * b));
    (0..grid.pixels())
        .into_par_iter()
        .map(|i| {
            let (ma, mb) = (mean_a[i], mean_b[i]);
            let (var_a, var_b, cov) = (aa[i] - ma * ma, bb[i] - mb * mb, ab[i] - ma * mb);
            ((2.0 * ma * mb + C1) * (2.0 * cov + C2)) / ((ma * ma + mb * mb + C1) * (var_a + var_b + C2))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_images_leave_only_the_luminance_term() {
        let grid = Grid { width: 13, height: 12 };
        let (a, b) = (vec![vec![0.2f32; 156]], vec![vec![0.6f32; 156]]);
        let map = ssim_map(&a, &b, grid);
        let expected = (2.0 * 0.2 * 0.6 + C1) / (0.2 * 0.2 + 0.6 * 0.6 + C1);
        let counted: Vec<f64> = map.iter().flatten().copied().collect();
        assert_eq!(counted.len(), 3 * 2);
        // The means come from f32 values, so 1e-7 is what can be asked.
        assert!(counted.iter().all(|value| (value - expected).abs() < 1e-6), "{counted:?} {expected}");
    }

    #[test]
    fn an_image_smaller_than_the_window_has_none() {
        let grid = Grid { width: 10, height: 40 };
        let plane = vec![vec![0.5f32; 400]];
        assert!(ssim_map(&plane, &plane, grid).iter().all(Option::is_none));
    }
}
