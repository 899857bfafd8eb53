use rayon::prelude::*;

/// The size of a plane of pixels stored row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid {
    pub width: usize,
    pub height: usize,
}

impl Grid {
    pub fn pixels(self) -> usize {
        self.width * self.height
    }
}

/// Correlates with `kernel_x` along rows, then with `kernel_y` along columns; kernels are of odd length.
///
/// Beyond the border the nearest pixel of the image repeats, as in FLIP.
pub(super) fn convolve_separable(plane: &[f64], grid: Grid, kernel_x: &[f64], kernel_y: &[f64]) -> Vec<f64> {
    let Grid { width, height } = grid;
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(target, source)| {
        for (x, sum) in target.iter_mut().enumerate() {
            *sum = taps(kernel_x, x, width).map(|(weight, x)| weight * source[x]).sum();
        }
    });
    let mut result = vec![0.0; plane.len()];
    result.par_chunks_mut(width).enumerate().for_each(|(y, target)| {
        for (weight, y) in taps(kernel_y, y, height) {
            let source = &rows[y * width..(y + 1) * width];
            for (sum, value) in target.iter_mut().zip(source) {
                *sum += weight * value;
            }
        }
    });
    result
}

/// The weights of a kernel centred on `centre` with the positions they fall on, clamped to `0..length`.
fn taps(kernel: &[f64], centre: usize, length: usize) -> impl Iterator<Item = (f64, usize)> + '_ {
    let radius = kernel.len() / 2;
    let position = move |tap: usize| (centre + tap).saturating_sub(radius).min(length - 1);
    kernel.iter().enumerate().map(move |(tap, &weight)| (weight, position(tap)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_kernel_shifts_and_repeats_the_border() {
        let grid = Grid { width: 3, height: 2 };
        let plane = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let right_neighbour = [0.0, 0.0, 1.0];
        let same = [1.0];
        assert_eq!(convolve_separable(&plane, grid, &right_neighbour, &same), [2.0, 3.0, 3.0, 5.0, 6.0, 6.0]);
        assert_eq!(convolve_separable(&plane, grid, &same, &right_neighbour), [4.0, 5.0, 6.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn a_kernel_wider_than_the_image_keeps_a_constant() {
        let grid = Grid { width: 1, height: 1 };
        assert_eq!(convolve_separable(&[0.5], grid, &[0.25; 4], &[0.5, 0.5, 0.0]), [0.5]);
    }
}
