use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

/// The figures of one comparison. Serialises to one JSON object; a figure that does not exist is `null`.
///
/// Differences are A − B. Display-referred figures (`rmse_display`, `psnr_db`, `ssim`, `flip_mean`) are measured on code
/// values in [0, 1] after exposure and encoding; they are `null` for layers of data (depth, normals).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The first image.
    pub a: InputInfo,
    /// The second image.
    pub b: InputInfo,
    /// Channels that were compared.
    pub channels: Vec<String>,
    /// True if every compared sample is equal in both and none is NaN; then PSNR, being infinite, is `null`.
    pub identical: bool,
    /// Radiance above which both images are clipped for `rmse_linear`; 1.0 = white. `null` for layers of data.
    pub clip_white: Option<f32>,
    /// Stops of exposure before encoding for display.
    pub exposure_ev: f32,
    /// How radiance is encoded for display: `sRGB` or `camera response`.
    pub display_encoding: &'static str,
    /// Peak value of both PSNRs.
    pub psnr_peak: f64,
    /// Viewing condition of FLIP.
    pub flip_pixels_per_degree: f64,
    /// Over all pixels.
    #[serde(flatten)]
    pub all: Figures,
    /// Over the sets of a coverage layer; `null` without one.
    pub sets: Option<SetFigures>,
    /// What the reader of the figures should know.
    pub notes: Vec<String>,
}

/// One side of a comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputInfo {
    /// File and layer, as `file.exr#layer`.
    pub name: String,
    /// Width in pixels.
    pub width_px: usize,
    /// Height in pixels.
    pub height_px: usize,
    /// All channels of the image.
    pub channels: Vec<String>,
    /// Samples that are not a number, in all channels.
    pub nan_samples: u64,
    /// Samples that are infinite.
    pub infinite_samples: u64,
    /// Finite samples below zero.
    pub negative_samples: u64,
}

/// Figures per set of pixels.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetFigures {
    /// Coverage 0.
    pub real: Figures,
    /// Coverage 1.
    #[serde(rename = "virtual")]
    pub virtual_: Figures,
    /// Coverage between.
    pub edge: Figures,
}

/// The errors over a set of pixels; all `None` where the set is empty.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Pixels that count: finite in every compared channel of both images.
    pub pixels: usize,
    /// Pixels left out because a compared channel is NaN or infinite in one of the images.
    pub pixels_excluded: usize,
    /// Root mean square over pixels and channels of A − B, both clipped to `clip_white` from above.
    pub rmse_linear: Option<f64>,
    /// The same without clipping.
    pub rmse_linear_unclipped: Option<f64>,
    /// Mean of A − B per channel, unclipped: positive where A is brighter.
    pub mean_difference: BTreeMap<String, f64>,
    /// Largest |A − B| over pixels and channels, unclipped.
    pub max_abs_difference: Option<f64>,
    /// Root mean square difference of the code values.
    pub rmse_display: Option<f64>,
    /// 20·log10(peak / `rmse_display`); `None` where it is infinite.
    pub psnr_db: Option<f64>,
    /// 20·log10(peak / `rmse_linear`); `None` where it is infinite.
    pub psnr_linear_db: Option<f64>,
    /// Mean structural similarity of the code values (Gaussian window of 11×11, σ 1.5) over windows inside the image,
    /// counted to the set their centre is in; `None` where there is none.
    pub ssim: Option<f64>,
    /// Windows that count for `ssim`.
    pub ssim_windows: usize,
    /// Mean LDR-FLIP of the code values.
    pub flip_mean: Option<f64>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (label, input) in [("A", &self.a), ("B", &self.b)] {
            let InputInfo { name, width_px, height_px, .. } = input;
            writeln!(f, "{label}  {name}  {width_px}x{height_px} px  {}", input.channels.join(" "))?;
        }
        let channels = self.channels.join(" ");
        match self.clip_white {
            Some(clip) => {
                let (ev, encoding, ppd) =
                    (self.exposure_ev, self.display_encoding, self.flip_pixels_per_degree);
                writeln!(
                    f,
                    "differences are A - B in {channels}; clip {clip} x white; \
                     display {encoding} at {ev} EV; PSNR peak {}; FLIP {ppd} px/deg",
                    self.psnr_peak
                )?;
            }
            None => writeln!(
                f,
                "differences are A - B in {channels}, which are data: no clip, no display figures"
            )?,
        }
        let mut columns = vec![("all", &self.all)];
        if let Some(sets) = &self.sets {
            columns.extend([("real", &sets.real), ("virtual", &sets.virtual_), ("edge", &sets.edge)]);
        }
        writeln!(f)?;
        write_table(f, &self.channels, &columns)?;
        if self.identical {
            writeln!(f, "\nthe images are identical (PSNR infinite)")?;
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        Ok(())
    }
}

fn write_table(f: &mut fmt::Formatter<'_>, channels: &[String], columns: &[(&str, &Figures)]) -> fmt::Result {
    let mut row = |label: &str, cell: &dyn Fn(&str, &Figures) -> String| {
        write!(f, "{label:<26}")?;
        for (name, figures) in columns {
            write!(f, "{:>14}", cell(name, figures))?;
        }
        writeln!(f)
    };
    row("", &|name, _| name.into())?;
    row("pixels", &|_, figures| figures.pixels.to_string())?;
    row("pixels excluded", &|_, figures| figures.pixels_excluded.to_string())?;
    row("RMSE linear, clipped", &|_, figures| cell(figures.rmse_linear))?;
    row("RMSE linear, unclipped", &|_, figures| cell(figures.rmse_linear_unclipped))?;
    for channel in channels {
        row(&format!("mean difference {channel}"), &|_, figures| {
            cell(figures.mean_difference.get(channel).copied())
        })?;
    }
    row("largest |difference|", &|_, figures| cell(figures.max_abs_difference))?;
    row("RMSE display", &|_, figures| cell(figures.rmse_display))?;
    row("PSNR display (dB)", &|_, figures| cell(figures.psnr_db))?;
    row("PSNR linear (dB)", &|_, figures| cell(figures.psnr_linear_db))?;
    row("SSIM", &|_, figures| cell(figures.ssim))?;
    row("FLIP mean", &|_, figures| cell(figures.flip_mean))
}

fn cell(figure: Option<f64>) -> String {
    match figure {
        None => "-".into(),
        Some(0.0) => "0".into(),
        Some(value) if (1e-3..1e5).contains(&value.abs()) => format!("{value:.5}"),
        Some(value) => format!("{value:.4e}"),
    }
}
