//! How noisy an image is.

use crate::luma::Luma;

/// Pixels that are looked at, about.
const SAMPLES: f64 = 5_000.0;

/// Standard deviation of the noise, in codes: the lower quartile of what the Laplacian of Immerkær (*Fast Noise Variance
/// Estimation*, CVIU 1996) leaves of the image. Edges and texture are left as well, noise alone everywhere: a part of an image
/// that a tag fills is a quarter flat. 0 for an image of less than 3 × 3 pixels.
pub(super) fn noise(image: &Luma) -> f64 {
    let (width, height) = (image.width_px(), image.height_px());
    let share = f64::from(width) * f64::from(height) / SAMPLES;
    let step = share.sqrt().ceil().max(1.0) as usize;
    let mut counts = [0_u32; 4 * 4 * 255 + 1];
    for y in (1..height.saturating_sub(1)).step_by(step) {
        let rows = [y - 1, y, y + 1].map(|y| image.row(y));
        for x in (1..(width as usize).saturating_sub(1)).step_by(step) {
            let [Some(above), Some(here), Some(below)] = rows.map(|row| row.get(x - 1..=x + 1)) else {
                continue;
            };
            let [a, b, c] = [above, here, below].map(|row| row.iter().map(|code| i32::from(*code)));
            let weighted = |row: &mut dyn Iterator<Item = i32>, weights: [i32; 3]| -> i32 {
                row.zip(weights).map(|(code, weight)| code * weight).sum()
            };
            let laplacian = weighted(&mut a.into_iter(), [1, -2, 1])
                + weighted(&mut b.into_iter(), [-2, 4, -2])
                + weighted(&mut c.into_iter(), [1, -2, 1]);
            if let Some(count) = counts.get_mut(laplacian.unsigned_abs() as usize) {
                *count += 1;
            }
        }
    }
    // The squares of the weights sum to 36; a quarter of all |x| are below 0.3186 standard deviations.
    lower_quartile(&counts) / (6.0 * 0.3186)
}

/// Of whole numbers, each of which stands for the interval around it.
fn lower_quartile(counts: &[u32]) -> f64 {
    let total: u32 = counts.iter().sum();
    let quarter = f64::from(total) / 4.0;
    let mut below = 0.0;
    for (value, count) in counts.iter().enumerate() {
        let count = f64::from(*count);
        if below + count > quarter {
            return (value as f64 - 0.5 + (quarter - below) / count).max(0.0);
        }
        below += count;
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_of_a_ramp_is_found() {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64
        };
        for sigma in [0.0, 2.0, 8.0] {
            // The sum of twelve numbers of variance 1/12.
            let pixels: Vec<u8> = (0..400 * 300)
                .map(|i| {
                    let normal = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                    (60.0 + f64::from(i % 400) * 0.2 + sigma * normal).round() as u8
                })
                .collect();
            let found = noise(&Luma::new(&pixels, 400, 300, 400).unwrap());
            // 5000 samples, whose quartile is known to 2 %; rounding adds 0.29.
            assert!((found - sigma).abs() < 0.35 + 0.06 * sigma, "{sigma}: {found}");
        }
        assert_eq!(noise(&Luma::new(&[9; 4], 2, 2, 2).unwrap()), 0.0);
    }
}
