use super::coverage::PixelSet;
use super::prepare::Prepared;
use super::report::Figures;

/// Peak of both PSNRs: white.
pub(super) const PSNR_PEAK: f64 = 1.0;

/// Per-pixel maps of the figures that have a neighbourhood.
pub(super) struct Maps {
    pub ssim: Vec<Option<f64>>,
    pub flip: Vec<f64>,
}

/// Means over the pixels of `set`, or over all.
pub(super) fn figures(
    prepared: &Prepared<'_>,
    maps: Option<&Maps>,
    clip: Option<f32>,
    sets: Option<(&[PixelSet], PixelSet)>,
) -> Figures {
    let in_set = |i: usize| sets.is_none_or(|(of_pixel, set)| of_pixel[i] == set);
    let members = || (0..prepared.grid.pixels()).filter(|&i| in_set(i));
    let counted: Vec<usize> = members().filter(|&i| prepared.valid[i]).collect();
    let mut figures = Figures {
        pixels: counted.len(),
        pixels_excluded: members().count() - counted.len(),
        ..Figures::default()
    };
    if counted.is_empty() {
        return figures;
    }

    let pixels = counted.len() as f64;
    let samples = pixels * prepared.names.len() as f64;
    let clipped = |value: f32| f64::from(clip.map_or(value, |clip| value.min(clip)));
    let (mut square, mut square_clipped, mut largest) = (0.0, 0.0, 0.0f64);
    for (channel, name) in prepared.names.iter().enumerate() {
        let (a, b) = (prepared.a[channel], prepared.b[channel]);
        let mut sum = 0.0;
        for &i in &counted {
            let difference = f64::from(a[i]) - f64::from(b[i]);
            sum += difference;
            square += difference * difference;
            square_clipped += (clipped(a[i]) - clipped(b[i])).powi(2);
            largest = largest.max(difference.abs());
        }
        figures.mean_difference.insert(name.clone(), sum / pixels);
    }
    let rmse_linear = (square_clipped / samples).sqrt();
    figures.rmse_linear = Some(rmse_linear);
    figures.rmse_linear_unclipped = Some((square / samples).sqrt());
    figures.max_abs_difference = Some(largest);

    if let (Some(display), Some(maps)) = (&prepared.display, maps) {
        let square: f64 = display.a.iter().zip(&display.b).map(|(a, b)| square_sum(a, b, &counted)).sum();
        let rmse_display = (square / samples).sqrt();
        figures.rmse_display = Some(rmse_display);
        figures.psnr_db = psnr(rmse_display);
        figures.psnr_linear_db = psnr(rmse_linear);
        let windows: Vec<f64> = counted.iter().filter_map(|&i| maps.ssim[i]).collect();
        figures.ssim_windows = windows.len();
        figures.ssim = (!windows.is_empty()).then(|| windows.iter().sum::<f64>() / windows.len() as f64);
        figures.flip_mean = Some(counted.iter().map(|&i| maps.flip[i]).sum::<f64>() / pixels);
    }
    figures
}

fn square_sum(a: &[f32], b: &[f32], pixels: &[usize]) -> f64 {
    pixels.iter().map(|&i| (f64::from(a[i]) - f64::from(b[i])).powi(2)).sum()
}

fn psnr(rmse: f64) -> Option<f64> {
    (rmse > 0.0).then(|| 20.0 * (PSNR_PEAK / rmse).log10())
}
