use super::CompareError;
use coshade_image_file::Image;

/// Coverage this near to 0 or 1 counts as that: sums of sample weights in `f32` miss it by rounding.
const ROUNDING: f32 = 1e-4;

/// How much of a pixel virtual things cover.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PixelSet {
    /// None of it.
    Real,
    /// All of it.
    Virtual,
    /// Part of it.
    Edge,
}

/// Sorts the pixels of a coverage layer into sets. It has one channel, or several that are the same; alpha counts only
/// if it is alone.
pub(super) fn pixel_sets(coverage: &Image, name: &str) -> Result<Vec<PixelSet>, CompareError> {
    let error = |reason: String| CompareError::Coverage { coverage: name.into(), reason };
    let mut planes = coverage.channels().iter().filter(|channel| channel.name != "A");
    let first = planes.next().or(coverage.channels().first());
    let first = first.ok_or_else(|| error("it has no channel".into()))?;
    if let Some(other) = planes.find(|other| other.samples != first.samples) {
        return Err(error(format!("channels {} and {} differ", first.name, other.name)));
    }
    let set = |(index, &share): (usize, &f32)| match share {
        share if share.abs() <= ROUNDING => Ok(PixelSet::Real),
        share if (share - 1.0).abs() <= ROUNDING => Ok(PixelSet::Virtual),
        share if share > 0.0 && share < 1.0 => Ok(PixelSet::Edge),
        other => {
            let (x, y) = (index % coverage.width(), index / coverage.width());
            Err(error(format!("{other} at pixel ({x}, {y}) is not in [0, 1]")))
        }
    };
    first.samples.iter().enumerate().map(set).collect()
}
