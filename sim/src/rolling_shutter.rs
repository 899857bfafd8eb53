//! Rows that are exposed one after the other.

use std::ops::Range;

/// Read-out of an image, row by row from the top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RollingShutter {
    /// From the exposure of the first row to that of the last; 0 for a global shutter.
    pub readout_s: f64,
    /// Rows of the image.
    pub height_px: u32,
    /// The rows are traced in so many bands, each at the time of its middle. As many as rows: exact.
    pub bands: u32,
}

impl RollingShutter {
    /// Time of a row (may be fractional) against that of the image, which is that of its centre row.
    pub fn row_time_s(&self, row: f64) -> f64 {
        let last = f64::from(self.height_px.saturating_sub(1).max(1));
        (row / last - 0.5) * self.readout_s
    }

    /// The bands from the top, with their times against that of the image.
    pub fn bands(&self) -> Vec<(Range<u32>, f64)> {
        if self.readout_s == 0.0 || self.height_px < 2 {
            return vec![(0..self.height_px, 0.0)];
        }
        let count = self.bands.clamp(1, self.height_px);
        let border = |k: u32| (u64::from(k) * u64::from(self.height_px) / u64::from(count)) as u32;
        let bands = (0..count).map(|k| border(k)..border(k + 1));
        bands
            .map(|rows| (rows.clone(), self.row_time_s(f64::from(rows.start + rows.end - 1) / 2.0)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_the_image_and_their_times_the_readout() {
        for (height_px, bands) in [(480, 480), (481, 32), (7, 100), (2, 1)] {
            let shutter = RollingShutter { readout_s: 0.02, height_px, bands };
            let made = shutter.bands();
            assert_eq!(made[0].0.start, 0);
            assert_eq!(made.last().unwrap().0.end, height_px);
            assert!(made.windows(2).all(|pair| pair[0].0.end == pair[1].0.start && pair[0].1 < pair[1].1));
            assert!((made.iter().map(|(rows, t)| rows.len() as f64 * t).sum::<f64>()).abs() < 1e-12);
        }
        let exact = RollingShutter { readout_s: 0.02, height_px: 480, bands: 480 };
        assert_eq!((exact.row_time_s(0.0), exact.row_time_s(479.0)), (-0.01, 0.01));
        let global = RollingShutter { readout_s: 0.0, ..exact };
        assert_eq!(global.bands(), [(0..480, 0.0)]);
    }
}
