//! Corners of a tag as exactly as its pixels tell: the whole printed pattern is fitted, not only its outline.
//!
//! Once a tag is decoded, all of its black and white cells are known. They are drawn through a homography in a plane that
//! touches the view sphere at the tag (so that straight edges are straight under any lens), blurred, lit, and compared
//! with the pixels of the original image. Gauss–Newton moves the homography (8 unknowns), the blur (1) and the light
//! (7: black and white with linear gradients, and a curvature) until the squares of the differences are least; Tukey's
//! weights leave out what covers the tag. Edges of both directions across the pattern fix the place of the corners even
//! where ink spread or a response curve moves all dark edges outwards: that is what the curvature takes up.
//!
//! This is maximum likelihood for pixels of independent noise, so the inverse of the normal matrix is the corners'
//! covariance. Limits: motion blur is taken for an isotropic one; the surface is flat.

mod chart;
mod fit;
mod gaussian;
mod light;
mod template;

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use coshade_lens::model::CameraModel;
use coshade_lens::response::Response;
use nalgebra::{Matrix2, SMatrix, Vector2};

use crate::bitmap::TagError;
use crate::detection::{TagId, TagObservation};
use crate::luma::Luma;
use chart::{Chart, is_front};
use fit::{Fit, Fitted, Scratch, TOLERATED};
use light::LightOfCode;
use template::Template;

/// How corners are refined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefineSettings {
    /// Most pixels of a tag that are looked at. Higher: more exact on large tags. Lower: faster.
    pub max_pixels: usize,
    /// Most steps. Higher: also finds corners that were a cell off. Lower: bounds the time.
    pub max_iterations: u32,
    /// How much of the pixels' variance the tag must explain to count as seen, 0 to 1. Higher: surer. Lower: more of a
    /// tag may be covered.
    pub min_explained: f64,
    /// Error of what is not random (print, lens, shape of the blur), in px: added to every covariance.
    pub floor_px: f64,
}

impl Default for RefineSettings {
    fn default() -> Self {
        Self { max_pixels: 3000, max_iterations: 12, min_explained: 0.5, floor_px: 0.01 }
    }
}

/// A tag fitted to its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// Its corners and their covariance.
    pub observation: TagObservation,
    /// Standard deviation of the image's blur, in px.
    pub blur_px: f64,
    /// White minus black, in light × 255.
    pub contrast: f64,
    /// Noise: root mean square of what is left, in the same unit.
    pub residual: f64,
    /// How much of the pixels' variance the tag explains: 1 all, 0 nothing.
    pub explained: f64,
    /// Pixels that were looked at.
    pub pixels: usize,
    /// Steps that were made.
    pub iterations: u32,
}

/// Why corners cannot be refined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// No such tag.
    #[error(transparent)]
    Tag(#[from] TagError),
    /// The corners are no outline of a tag seen from its front within the field of view.
    #[error("{0}: its corners are not those of a tag seen from its front")]
    Corners(TagId),
    /// Too few pixels of it lie in the image.
    #[error("{tag}: only {pixels} pixels of it are in the image")]
    Small {
        /// Which tag.
        tag: TagId,
        /// How many.
        pixels: usize,
    },
    /// The pixels show no pattern.
    #[error("the pixels are all alike")]
    Flat,
    /// The fit has left the tag.
    #[error("the fit has left the tag")]
    Lost,
    /// Something else is there.
    #[error("{tag}: explains only {} % of the pixels' variance", (100.0 * explained).round())]
    Unlike {
        /// Which tag.
        tag: TagId,
        /// 1 all, 0 nothing.
        explained: f64,
    },
}

/// How far a fit is taken.
#[derive(Clone, Copy, Debug)]
struct Stage {
    max_pixels: usize,
    max_iterations: u32,
    /// Corners that move by less in a step are done, in px. Gauss–Newton's next step would be a tenth of it or less.
    converged_px: f64,
    /// Deviations that are tolerated in the first step, as a fraction of the contrast. Corners that are a cell off deviate
    /// by much.
    tolerated: f64,
}

/// A pixel to be explained.
#[derive(Clone, Copy, Debug)]
struct Sample {
    place: Vector2<f64>,
    /// ∂place/∂px.
    by_px: Matrix2<f64>,
    light: f64,
    weight: f64,
    clipped: bool,
}

/// A coarse fit looks at so many pixels at least.
const MIN_COARSE: usize = 600;
/// Fewest pixels from which 16 unknowns are found with some to spare.
const MIN_PIXELS: usize = 48;
/// Blur that a fit starts with, in px.
const START_BLUR_PX: f64 = 0.9;
/// Distance from an edge between cells, in standard deviations of the blur, beyond which pixels say nothing of it.
const EDGE_REACH: f64 = 1.6;
/// Largest share of a pixel's light that may come from where anything may be printed.
const MAX_UNKNOWN: f64 = 0.02;
/// How far that light may be from what is assumed of it, as a fraction of white minus black.
const UNKNOWN_DEVIATION: f64 = 0.5;
/// How much of a tag's pixels lies near edges, roughly.
const EDGE_SHARE: f64 = 0.35;
/// Of the pixels that say nothing of an edge, one in so many is kept: they say what is black and white.
const FLAT_SHARE: u32 = 8;

/// Refines corners in images of one camera.
#[derive(Clone, Debug)]
pub struct Refiner {
    lens: Option<CameraModel>,
    light: LightOfCode,
    settings: RefineSettings,
    templates: HashMap<TagId, Template>,
    samples: Vec<Sample>,
    scratch: Scratch,
}

impl Refiner {
    /// For a camera with a `lens` (without: edges are taken to be straight in the image) and a `response`.
    pub fn new(lens: Option<CameraModel>, response: &Response, settings: RefineSettings) -> Self {
        let light = LightOfCode::new(response);
        Self {
            lens,
            light,
            settings,
            templates: HashMap::new(),
            samples: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Refines corners that are right to about a cell of the tag.
    ///
    /// # Errors
    /// [`RefineError`] where the image does not show the tag there.
    pub fn refine(
        &mut self,
        image: &Luma,
        tag: TagId,
        corners_px: &[Vector2<f64>; 4],
    ) -> Result<Refined, RefineError> {
        let RefineSettings { max_pixels, max_iterations, .. } = self.settings;
        // Which pixels speak, and how loudly, depends on blur and noise, which a first, coarse fit finds.
        let coarse = Stage {
            max_pixels: (max_pixels / 4).max(MIN_COARSE),
            max_iterations,
            converged_px: 0.1,
            tolerated: 0.24,
        };
        let fine = Stage { max_pixels, converged_px: 0.02, tolerated: TOLERATED, ..coarse };
        self.run(image, tag, corners_px, &[coarse, fine])
    }

    /// As [`refine`](Self::refine), for corners that are right to a pixel or two, looking at another number of pixels: to
    /// follow a tag fast.
    ///
    /// # Errors
    /// As [`refine`](Self::refine).
    pub fn refine_near(
        &mut self,
        image: &Luma,
        tag: TagId,
        corners_px: &[Vector2<f64>; 4],
        max_pixels: usize,
    ) -> Result<Refined, RefineError> {
        let max_iterations = self.settings.max_iterations;
        let near = Stage { max_pixels, max_iterations, converged_px: 0.04, tolerated: 0.24 };
        self.run(image, tag, corners_px, &[near])
    }

    fn run(
        &mut self,
        image: &Luma,
        tag: TagId,
        corners_px: &[Vector2<f64>; 4],
        stages: &[Stage],
    ) -> Result<Refined, RefineError> {
        if corners_px.iter().flatten().any(|coordinate| !coordinate.is_finite()) || !is_front(corners_px) {
            return Err(RefineError::Corners(tag));
        }
        let template = match self.templates.entry(tag) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert(Template::new(tag)?),
        };
        let chart = Chart::around(self.lens.as_ref(), corners_px).ok_or(RefineError::Corners(tag))?;
        let mut fit =
            Fit::start(template, &chart, corners_px, START_BLUR_PX).ok_or(RefineError::Corners(tag))?;
        let mut sums = None;
        for stage in stages {
            collect(&mut self.samples, image, &self.light, &chart, &fit, stage.max_pixels)
                .ok_or(RefineError::Corners(tag))?;
            let pixels = self.samples.len();
            if pixels < MIN_PIXELS {
                return Err(RefineError::Small { tag, pixels });
            }
            sums = Some(fit.run(&self.samples, stage, &mut self.scratch)?);
        }
        let pixels = self.samples.len();
        let sums = sums.ok_or(RefineError::Flat)?;
        let Fitted { corners_px, covariance_px2, blur_px, contrast, residual, explained, iterations } =
            fit.finish(&sums, &self.samples, &self.scratch)?;
        let settings = &self.settings;
        if explained.is_nan() || explained < settings.min_explained {
            return Err(RefineError::Unlike { tag, explained });
        }
        let floor = SMatrix::<f64, 8, 8>::identity() * settings.floor_px.powi(2);
        let observation = TagObservation { tag, corners_px, covariance_px2: covariance_px2 + floor };
        Ok(Refined { observation, blur_px, contrast, residual, explained, pixels, iterations })
    }
}

/// The pixels on the tag that say where its edges are, thinned out to the number wanted.
fn collect(
    samples: &mut Vec<Sample>,
    image: &Luma,
    light: &LightOfCode,
    chart: &Chart,
    fit: &Fit,
    max_pixels: usize,
) -> Option<()> {
    samples.clear();
    let template = fit.template();
    let unknown_variance = (UNKNOWN_DEVIATION * fit.contrast_to_noise()).powi(2);
    let [low, high] = bounds(chart, template, fit, image)?;
    let area = (high - low + Vector2::repeat(1.0)).product();
    let share = max_pixels as f64 / (EDGE_SHARE * area);
    let below = (share.min(1.0) * f64::from(u32::MAX)) as u32;
    let derivative = Derivative::new(chart, low, high)?;
    let (mut flat, [left, top, right, bottom]) =
        (0, [low.x as u32, low.y as u32, high.x as u32, high.y as u32]);
    for y in top..=bottom {
        let row = image.row(y);
        for x in left..=right {
            if scattered(x, y) > below {
                continue;
            }
            let (Some(code), px) = (row.get(x as usize), Vector2::new(f64::from(x), f64::from(y))) else {
                continue;
            };
            let Some(place) = chart.place(&px) else { continue };
            let Some((cell, by_place)) = fit.cell(&place) else { continue };
            let by_px = derivative.at(&px);
            let cell_by_px = by_place * by_px;
            let sigma = Vector2::new(cell_by_px.row(0).norm(), cell_by_px.row(1).norm()) * fit.blur_px();
            let unknown = template.unknown(cell, sigma);
            if unknown > MAX_UNKNOWN {
                continue;
            }
            if !template.is_near_edge(cell, sigma * EDGE_REACH) {
                flat += 1;
                if flat % FLAT_SHARE != 0 {
                    continue;
                }
            }
            let slope = light.slope(*code);
            samples.push(Sample {
                place,
                by_px,
                light: light.of(*code),
                weight: 1.0 / (slope * slope + unknown_variance * unknown * unknown),
                clipped: *code == u8::MAX,
            });
        }
    }
    Some(())
}

/// A number for each pixel: those below any bound lie evenly spread. Roberts' R₂ sequence as a lattice, in fractions of 2³².
fn scattered(x: u32, y: u32) -> u32 {
    x.wrapping_mul(0xc13f_a9a9).wrapping_add(y.wrapping_mul(0x91e1_0da5))
}

/// The rectangle of pixels around the tag and its outer ring, within the image.
fn bounds(chart: &Chart, template: &Template, fit: &Fit, image: &Luma) -> Option<[Vector2<f64>; 2]> {
    let chart_from_cells = fit.chart_from_cells()?;
    let side = template.side();
    let ends = [0.0, 0.5 * side, side];
    let mut low = Vector2::repeat(f64::INFINITY);
    let mut high = -low;
    for cell in ends.iter().flat_map(|x| ends.map(|y| Vector2::new(*x, y))) {
        let point = chart_from_cells * cell.push(1.0);
        // Beyond the horizon of the chart, or of the lens: what is inside will do.
        if point.z < 1e-6 {
            continue;
        }
        if let Some(place) = chart.in_image(&(point.xy() / point.z)) {
            low = low.inf(&place.px);
            high = high.sup(&place.px);
        }
    }
    let last = Vector2::new(f64::from(image.width_px() - 1), f64::from(image.height_px() - 1));
    let low = low.map(f64::floor).sup(&Vector2::zeros());
    let high = high.map(f64::ceil).inf(&last);
    (low.x <= high.x && low.y <= high.y).then_some([low, high])
}

/// ∂place/∂px over a rectangle of the image, between its values at the corners.
struct Derivative {
    low: Vector2<f64>,
    size: Vector2<f64>,
    corners: [Matrix2<f64>; 4],
}

impl Derivative {
    fn new(chart: &Chart, low: Vector2<f64>, high: Vector2<f64>) -> Option<Self> {
        let middle = chart.by_px(&((low + high) / 2.0));
        let at = |x: f64, y: f64| chart.by_px(&Vector2::new(x, y)).or(middle);
        let corners = [at(low.x, low.y)?, at(high.x, low.y)?, at(low.x, high.y)?, at(high.x, high.y)?];
        Some(Self { low, size: (high - low).sup(&Vector2::repeat(1.0)), corners })
    }

    fn at(&self, px: &Vector2<f64>) -> Matrix2<f64> {
        let t = (px - self.low).component_div(&self.size);
        let [a, b, c, d] = self.corners;
        (a * (1.0 - t.x) + b * t.x) * (1.0 - t.y) + (c * (1.0 - t.x) + d * t.x) * t.y
    }
}
