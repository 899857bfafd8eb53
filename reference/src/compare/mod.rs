//! How far two images are from each other.
//!
//! | figure | on | as |
//! | --- | --- | --- |
//! | RMSE, mean and largest difference | linear radiance, 1.0 = white | RMSE also clipped at 4 × white |
//! | PSNR, SSIM, FLIP | code values in [0, 1]: exposure, sRGB or the camera's response, clip | scikit-image, the authors' `flip-evaluator` |
//!
//! All of them over all pixels and, with a coverage layer, apart over real (0), virtual (1) and edge (between) pixels.
//! A pixel that is NaN or infinite in a compared channel of either image is counted and left out of every mean; SSIM and
//! FLIP, which look at neighbourhoods, see it black in both images.

pub mod colour_map;
mod coverage;
mod display;
mod error;
mod figures;
mod flip;
mod font;
mod picture;
mod plane;
mod prepare;
mod report;
mod run;
mod ssim;

pub use display::{DisplayTransform, Response};
pub use error::CompareError;
pub use flip::PIXELS_PER_DEGREE as FLIP_PIXELS_PER_DEGREE;
pub use picture::{DifferencePicture, Picture, difference_picture, flip_picture};
pub use report::{Figures, InputInfo, Report, SetFigures};
pub use run::{CompareArgs, run};

use coshade_image_file::Image;
use coverage::PixelSet;
use figures::Maps;
use plane::Grid;

/// An image and what messages call it.
#[derive(Debug, Clone, Copy)]
pub struct Named<'a> {
    /// `truth.exr#mixed`.
    pub name: &'a str,
    /// The pixels.
    pub image: &'a Image,
}

/// What to compare and how.
#[derive(Debug, Clone)]
pub struct CompareOptions<'a> {
    /// Radiance above which both images are clipped for `rmse_linear`, in multiples of white.
    pub clip_white: f32,
    /// How radiance becomes code values.
    pub display: DisplayTransform,
    /// Share of each pixel that virtual things cover.
    pub coverage: Option<Named<'a>>,
}

impl Default for CompareOptions<'_> {
    /// Clip at 4 × white, sRGB at 0 EV, no coverage.
    fn default() -> Self {
        Self { clip_white: 4.0, display: DisplayTransform::default(), coverage: None }
    }
}

/// A report, and the per-pixel maps it is the mean of.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The figures.
    pub report: Report,
    /// Signed difference A − B per pixel, clipped as `rmse_linear`, of the channel where it is largest; `None` where
    /// the pixel does not count.
    pub difference: Vec<Option<f32>>,
    /// FLIP error per pixel; `None` for layers of data.
    pub flip: Option<Vec<f64>>,
}

/// Compares two images of the same size and channels.
///
/// Colour images (R G B, or Y) are compared in colour, not in alpha. Other layers (depth, normals) are compared as data:
/// unclipped, without display-referred figures.
///
/// # Errors
/// Sizes, data windows or channels differ; the coverage layer is not in [0, 1] or of another size; an option is out of
/// range.
pub fn compare(a: Named<'_>, b: Named<'_>, options: &CompareOptions<'_>) -> Result<Comparison, CompareError> {
    check_options(options)?;
    let prepared = prepare::prepare(a, b, &options.display)?;
    let sets = options.coverage.map(|coverage| sets_of(a, coverage)).transpose()?;
    let maps = prepared.display.as_ref().map(|display| Maps {
        ssim: ssim::ssim_map(&display.a, &display.b, prepared.grid),
        flip: flip::flip_map(&display.a, &display.b, prepared.grid),
    });
    let clip_white = maps.as_ref().map(|_| options.clip_white);
    let of_set = |set: PixelSet, sets: &[PixelSet]| {
        figures::figures(&prepared, maps.as_ref(), clip_white, Some((sets, set)))
    };
    let report = Report {
        a: input_info(a),
        b: input_info(b),
        channels: prepared.names.clone(),
        identical: prepared.a == prepared.b,
        clip_white,
        exposure_ev: options.display.exposure_ev,
        display_encoding: options.display.name(),
        psnr_peak: figures::PSNR_PEAK,
        flip_pixels_per_degree: FLIP_PIXELS_PER_DEGREE,
        all: figures::figures(&prepared, maps.as_ref(), clip_white, None),
        sets: sets.map(|sets| SetFigures {
            real: of_set(PixelSet::Real, &sets),
            virtual_: of_set(PixelSet::Virtual, &sets),
            edge: of_set(PixelSet::Edge, &sets),
        }),
        notes: notes(&prepared),
    };
    let difference = picture::signed_difference(&prepared, clip_white);
    Ok(Comparison { report, difference, flip: maps.map(|maps| maps.flip) })
}

fn check_options(options: &CompareOptions<'_>) -> Result<(), CompareError> {
    let clip = options.clip_white;
    if !(clip > 0.0 && clip.is_finite()) {
        let expected = "a positive number of times white";
        return Err(CompareError::Option { option: "clip", value: clip.to_string(), expected });
    }
    let exposure = options.display.exposure_ev;
    if !(-64.0..=64.0).contains(&exposure) {
        let expected = "stops between -64 and 64";
        return Err(CompareError::Option { option: "exposure", value: exposure.to_string(), expected });
    }
    Ok(())
}

fn sets_of(a: Named<'_>, coverage: Named<'_>) -> Result<Vec<PixelSet>, CompareError> {
    let size = |image: &Image| [image.width(), image.height()];
    if size(coverage.image) != size(a.image) {
        return Err(CompareError::Size {
            a: a.name.into(),
            a_px: size(a.image),
            b: coverage.name.into(),
            b_px: size(coverage.image),
        });
    }
    coverage::pixel_sets(coverage.image, coverage.name)
}

fn input_info(named: Named<'_>) -> InputInfo {
    let census = named.image.census();
    InputInfo {
        name: named.name.into(),
        width_px: named.image.width(),
        height_px: named.image.height(),
        channels: named.image.channel_names().into_iter().map(String::from).collect(),
        nan_samples: census.nan,
        infinite_samples: census.infinite,
        negative_samples: census.negative,
    }
}

fn notes(prepared: &prepare::Prepared<'_>) -> Vec<String> {
    let mut notes = prepared.notes.clone();
    let excluded = prepared.valid.iter().filter(|valid| !**valid).count();
    if excluded > 0 {
        notes.push(format!(
            "{excluded} pixels are NaN or infinite in A or B and are left out of every figure"
        ));
    }
    let Grid { width, height } = prepared.grid;
    let window = 2 * ssim::RADIUS_PX + 1;
    if prepared.display.is_some() && (width < window || height < window) {
        notes.push(format!("no SSIM: {width}x{height} px is smaller than its window of {window}x{window}"));
    }
    notes
}
