//! LDR-FLIP: P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020.
//!
//! Written here because `nv-flip`, the binding to the authors' code, takes 8-bit images only, and rounding float images
//! to 8 bits moves the mean by up to 5e-3 where they differ little. It is tested against `nv-flip` on 8-bit images.

use rayon::prelude::*;

use super::plane::{Grid, convolve_separable};
use coshade_image_file::srgb;

/// The authors' default viewing condition: a 0.7 m wide 4K display seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

// Table 1 and section 4 of the paper.
const HYAB_EXPONENT: f64 = 0.7; // q_c
const LOW_ERROR_SHARE: f64 = 0.4; // p_c
const LOW_ERROR_TARGET: f64 = 0.95; // p_t
const FEATURE_EXPONENT: f64 = 0.5; // q_f
const FEATURE_WIDTH_DEG: f64 = 0.082; // w
/// Contrast sensitivity as Gaussians of (weight, width): achromatic, red-green, blue-yellow (a sum of two).
const ACHROMATIC: [(f64, f64); 1] = [(1.0, 0.0047)];
const RED_GREEN: [(f64, f64); 1] = [(1.0, 0.0053)];
const BLUE_YELLOW: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];
const WIDEST: f64 = 0.04;

type Vec3d = [f64; 3];

/// FLIP error in [0, 1] of every pixel, at [`PIXELS_PER_DEGREE`].
///
/// `a` and `b` are sRGB code values in [0, 1]: three planes, or one plane of grey.
pub(super) fn flip_map(a: &[Vec<f32>], b: &[Vec<f32>], grid: Grid) -> Vec<f64> {
    let (a, b) = (opponent_planes(a, grid), opponent_planes(b, grid));
    let (colour_a, colour_b) = (filtered_lab(&a, grid), filtered_lab(&b, grid));
    let (features_a, features_b) = (features(&a[0], grid), features(&b[0], grid));
    let largest = largest_colour_distance();
    (0..grid.pixels())
        .into_par_iter()
        .map(|i| {
            let colour = remap(hyab(colour_a[i], colour_b[i]).powf(HYAB_EXPONENT), largest);
            let ((edge_a, point_a), (edge_b, point_b)) = (features_a[i], features_b[i]);
            let feature = (edge_a - edge_b).abs().max((point_a - point_b).abs());
            let feature = (feature / 2f64.sqrt()).powf(FEATURE_EXPONENT);
            colour.powf(1.0 - feature)
        })
        .collect()
}

/// sRGB codes to the planes Y, Cx, Cz of the paper's opponent space (eq. 4: linearised CIELAB).
fn opponent_planes(codes: &[Vec<f32>], grid: Grid) -> [Vec<f64>; 3] {
    let [red, green, blue] = match codes {
        [red, green, blue] => [red, green, blue],
        [grey] => [grey, grey, grey],
        _ => return [const { Vec::new() }; 3],
    };
    let opponents: Vec<Vec3d> = (0..grid.pixels())
        .into_par_iter()
        .map(|i| {
            let rgb = [red[i], green[i], blue[i]].map(|code| srgb::decode(f64::from(code)));
            let [x, y, z] = relative_xyz(rgb);
            [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
        })
        .collect();
    [0, 1, 2].map(|axis| opponents.iter().map(|opponent| opponent[axis]).collect())
}

/// Filters with the contrast sensitivity functions (eq. 5), clamps to the RGB cube, and gives Hunt-adjusted CIELAB.
fn filtered_lab(opponents: &[Vec<f64>; 3], grid: Grid) -> Vec<Vec3d> {
    let [y, cx, cz] = opponents;
    let y = filter(y, grid, &ACHROMATIC);
    let cx = filter(cx, grid, &RED_GREEN);
    let cz = filter(cz, grid, &BLUE_YELLOW);
    (0..grid.pixels())
        .into_par_iter()
        .map(|i| {
            let luminance = (y[i] + 16.0) / 116.0;
            let xyz = [luminance + cx[i] / 500.0, luminance, luminance - cz[i] / 200.0];
            hunt_lab(linear_rgb(xyz).map(|value| value.clamp(0.0, 1.0)))
        })
        .collect()
}

/// Convolves with a normalised sum of 2D Gaussians, each of which is separable.
fn filter(plane: &[f64], grid: Grid, gaussians: &[(f64, f64)]) -> Vec<f64> {
    let pi = std::f64::consts::PI;
    let radius = (3.0 * (WIDEST / (2.0 * pi * pi)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let kernels: Vec<(f64, Vec<f64>)> = gaussians
        .iter()
        .map(|&(weight, width)| {
            let at = |x: i32| (-pi * pi * (f64::from(x) / PIXELS_PER_DEGREE).powi(2) / width).exp();
            (weight * (pi / width).sqrt(), (-radius..=radius).map(at).collect())
        })
        .collect();
    let volume: f64 =
        kernels.iter().map(|(weight, kernel)| weight * kernel.iter().sum::<f64>().powi(2)).sum();
    let mut sum = vec![0.0; plane.len()];
    for (weight, kernel) in &kernels {
        let part = convolve_separable(plane, grid, kernel, kernel);
        sum.par_iter_mut().zip(part).for_each(|(sum, part)| *sum += weight / volume * part);
    }
    sum
}

/// Strength of edges and of points in the lightness plane (section 4.2): gradient and second derivative at the size of a
/// feature that the eye resolves.
fn features(y: &[f64], grid: Grid) -> Vec<(f64, f64)> {
    let sigma = 0.5 * FEATURE_WIDTH_DEG * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as i32;
    let kernel = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        let at = |x: i32| {
            let x = f64::from(x);
            f(x, (-x * x / (2.0 * sigma * sigma)).exp())
        };
        (-radius..=radius).map(at).collect()
    };
    let smooth = kernel(&|_, gaussian| gaussian);
    let sum: f64 = smooth.iter().sum();
    let smooth: Vec<f64> = smooth.iter().map(|weight| weight / sum).collect();
    let edge = balanced(kernel(&|x, gaussian| -x * gaussian));
    let point = balanced(kernel(&|x, gaussian| (x * x / (sigma * sigma) - 1.0) * gaussian));

    let lightness: Vec<f64> = y.iter().map(|y| (y + 16.0) / 116.0).collect();
    let strength = |derivative: &[f64]| -> Vec<f64> {
        let dx = convolve_separable(&lightness, grid, derivative, &smooth);
        let dy = convolve_separable(&lightness, grid, &smooth, derivative);
        dx.into_iter().zip(dy).map(|(dx, dy)| dx.hypot(dy)).collect()
    };
    strength(&edge).into_iter().zip(strength(&point)).collect()
}

/// Scales positive weights to the sum 1 and negative ones to −1.
fn balanced(kernel: Vec<f64>) -> Vec<f64> {
    let positive: f64 = kernel.iter().filter(|weight| **weight > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|weight| **weight < 0.0).sum::<f64>();
    kernel.into_iter().map(|weight| weight / if weight > 0.0 { positive } else { negative }).collect()
}

/// Section 4.1.3: distances up to `LOW_ERROR_SHARE` of the largest spread over most of [0, 1].
fn remap(distance: f64, largest: f64) -> f64 {
    let knee = LOW_ERROR_SHARE * largest;
    if distance < knee {
        distance * LOW_ERROR_TARGET / knee
    } else {
        LOW_ERROR_TARGET + (distance - knee) / (largest - knee) * (1.0 - LOW_ERROR_TARGET)
    }
}

/// Between the colours farthest apart in Hunt-adjusted space: green and blue.
fn largest_colour_distance() -> f64 {
    hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(HYAB_EXPONENT)
}

/// Abasi et al. 2020: city-block in lightness, Euclidean in chroma.
fn hyab(a: Vec3d, b: Vec3d) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// CIELAB with chroma scaled by lightness (Hunt effect, eq. 6).
fn hunt_lab(rgb: Vec3d) -> Vec3d {
    let threshold = 6.0f64 / 29.0;
    let root = |t: f64| {
        if t > threshold.powi(3) { t.cbrt() } else { t / (3.0 * threshold * threshold) + 4.0 / 29.0 }
    };
    let [x, y, z] = relative_xyz(rgb).map(root);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Linear Rec.709 RGB to XYZ: the exact fractions of the primaries and D65, as in the authors' code.
const XYZ_FROM_RGB: [Vec3d; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];
const RGB_FROM_XYZ: [Vec3d; 3] = [
    [3.241003275, -1.537398934, -0.498615861],
    [-0.969224334, 1.875930071, 0.041554224],
    [0.055639423, -0.204011202, 1.057148933],
];
const WHITE_XYZ: Vec3d = [0.950428545, 1.0, 1.088900371];

/// XYZ divided by that of white.
fn relative_xyz(rgb: Vec3d) -> Vec3d {
    let xyz = multiply(&XYZ_FROM_RGB, rgb);
    [0, 1, 2].map(|axis| xyz[axis] / WHITE_XYZ[axis])
}

fn linear_rgb(relative_xyz: Vec3d) -> Vec3d {
    multiply(&RGB_FROM_XYZ, [0, 1, 2].map(|axis| relative_xyz[axis] * WHITE_XYZ[axis]))
}

fn multiply(matrix: &[Vec3d; 3], v: Vec3d) -> Vec3d {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture with edges, gradients, saturated colours and noise, from a linear congruential generator.
    fn picture(width: usize, height: usize, seed: u32) -> Vec<u8> {
        let mut state = seed;
        let mut noise = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 27
        };
        let pixel = |x: usize, y: usize| {
            let square = if (x / 9 + y / 7).is_multiple_of(2) { 140 } else { 20 };
            [square + x as u32 % 80, 255 * u32::from(x > width / 2), (y * 5) as u32 % 200]
        };
        (0..width * height)
            .flat_map(|i| pixel(i % width, i / width))
            .map(|value| (value + noise()).min(255) as u8)
            .collect()
    }

    fn planes(bytes: &[u8]) -> Vec<Vec<f32>> {
        let plane = |axis| bytes.iter().skip(axis).step_by(3).map(|&code| f32::from(code) / 255.0).collect();
        (0..3).map(plane).collect()
    }

    #[test]
    fn agrees_with_the_authors_code_pixel_by_pixel() {
        for (width, height) in [(61, 47), (5, 3), (1, 1), (2, 40)] {
            let (a, b) = (picture(width, height, 1), picture(width, height, 99));
            let grid = Grid { width, height };
            let ours = flip_map(&planes(&a), &planes(&b), grid);
            let image = |bytes| nv_flip::FlipImageRgb8::with_data(width as u32, height as u32, bytes);
            let theirs = nv_flip::flip(image(&a), image(&b), PIXELS_PER_DEGREE as f32).to_vec();
            let worst = ours.iter().zip(&theirs).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
            // Theirs works in f32; the power of 0.7 and the root of the feature term magnify its rounding
            // (1e-7 of values up to 116) where the images nearly agree.
            assert!(worst < 2e-4, "{width}x{height}: {worst}");
        }
    }

    #[test]
    fn identical_images_have_no_error_and_opposites_the_largest() {
        let grid = Grid { width: 30, height: 30 };
        let plane = |value| vec![vec![value; 900]; 3];
        assert!(flip_map(&plane(0.3), &plane(0.3), grid).iter().all(|error| *error == 0.0));
        let (green, mut blue) = (vec![vec![0.0; 900], vec![1.0; 900], vec![0.0; 900]], plane(0.0));
        blue[2] = vec![1.0; 900];
        // Green against blue is the distance that the scale ends at.
        let worst = flip_map(&green, &blue, grid);
        assert!(worst.iter().all(|error| (error - 1.0).abs() < 1e-6), "{:?}", &worst[..3]);
    }
}
