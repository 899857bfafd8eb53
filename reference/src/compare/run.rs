use std::path::PathBuf;

use super::{
    CompareError, CompareOptions, DisplayTransform, Named, Report, Response, compare, difference_picture,
    flip_picture,
};
use coshade_image_file::{ImageSpec, read_spec};

/// The arguments of `coshade compare A B`.
#[derive(Clone)]
pub struct CompareArgs {
    /// First image, `file` or `file.exr#layer`.
    pub a: String,
    /// Second image, the reference.
    pub b: String,
    /// Layer of both, where `a` or `b` names none.
    pub layer: Option<String>,
    /// Coverage, `file` or `file.exr#layer`: 0 real, 1 virtual, between edge.
    pub coverage: Option<String>,
    /// Clip of `rmse_linear` in multiples of white.
    pub clip_white: f32,
    /// Stops of exposure before the display-referred figures.
    pub exposure_ev: f32,
    /// The camera's response instead of sRGB.
    pub response: Option<Response>,
    /// Where to write a picture of the signed difference (PNG).
    pub diff: Option<PathBuf>,
    /// Radiance at the ends of that picture's colour scale; automatic if `None`.
    pub diff_limit: Option<f32>,
    /// Where to write a picture of the FLIP error (PNG).
    pub flip: Option<PathBuf>,
}

impl CompareArgs {
    /// Compares `a` with `b`: whole, clip 4, 0 EV, sRGB, no pictures.
    pub fn new(a: impl Into<String>, b: impl Into<String>) -> Self {
        Self {
            a: a.into(),
            b: b.into(),
            layer: None,
            coverage: None,
            clip_white: 4.0,
            exposure_ev: 0.0,
            response: None,
            diff: None,
            diff_limit: None,
            flip: None,
        }
    }

    fn spec(&self, text: &str) -> ImageSpec {
        let spec = ImageSpec::parse(text);
        ImageSpec { layer: spec.layer.or_else(|| self.layer.clone()), ..spec }
    }
}

/// Reads both images, compares them, and writes the pictures asked for.
///
/// # Errors
/// A file cannot be read or written, a layer is missing, or the images do not fit each other.
pub fn run(args: &CompareArgs) -> Result<Report, CompareError> {
    let (spec_a, spec_b) = (args.spec(&args.a), args.spec(&args.b));
    let (image_a, notes_a) = read_spec(&spec_a)?;
    let (image_b, notes_b) = read_spec(&spec_b)?;
    let coverage_spec = args.coverage.as_deref().map(ImageSpec::parse);
    let coverage = coverage_spec.as_ref().map(read_spec).transpose()?;

    let (name_a, name_b) = (spec_a.to_string(), spec_b.to_string());
    let coverage_name = coverage_spec.map(|spec| spec.to_string()).unwrap_or_default();
    let (a, b) = (Named { name: &name_a, image: &image_a }, Named { name: &name_b, image: &image_b });
    let options = CompareOptions {
        clip_white: args.clip_white,
        display: DisplayTransform { exposure_ev: args.exposure_ev, response: args.response.clone() },
        coverage: coverage.as_ref().map(|(image, _)| Named { name: &coverage_name, image }),
    };
    let comparison = compare(a, b, &options)?;

    if let Some(path) = &args.diff {
        difference_picture(&comparison, args.diff_limit)?.picture.save(path)?;
    }
    if let Some(path) = &args.flip {
        flip_picture(&comparison)?.save(path)?;
    }
    let mut report = comparison.report;
    let labelled = |label: &str, notes: Vec<String>| {
        notes.into_iter().map(|note| format!("{label}: {note}")).collect::<Vec<_>>()
    };
    report.notes.extend(labelled(&name_a, notes_a));
    report.notes.extend(labelled(&name_b, notes_b));
    Ok(report)
}
