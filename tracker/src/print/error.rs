//! Why a sheet cannot be printed.

use crate::bitmap::TagError;

use super::fit::Misfit;

/// Why a sheet cannot be printed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrintError {
    /// There is no such tag.
    #[error(transparent)]
    Tag(#[from] TagError),
    /// Nothing to print.
    #[error("no tags to print")]
    NoTags,
    /// More than a board file holds.
    #[error("{count} tags: at most 4096 make a board")]
    TooManyTags {
        /// What was asked for.
        count: usize,
    },
    /// A tag twice.
    #[error("tag {id} is there twice; a board holds every tag once")]
    Twice {
        /// Its number.
        id: u32,
    },
    /// Rows of different lengths.
    #[error("{tags} tags make no full rows of {columns}")]
    Rows {
        /// How many tags.
        tags: usize,
        /// How many in a row.
        columns: usize,
    },
    /// A length out of range.
    #[error("{name}: {value} is out of range; allowed: {allowed}")]
    Length {
        /// Which.
        name: &'static str,
        /// What was asked for.
        value: f64,
        /// What may be asked for.
        allowed: &'static str,
    },
    /// Tags so close that detectors miss them.
    #[error(
        "a gap of {gap_mm} mm is too narrow: detectors need a white ring of one cell around each tag, which for {family} \
         of {size_mm} mm is a gap of {needed_mm} mm at least"
    )]
    Gap {
        /// The family.
        family: crate::Family,
        /// Size of its tags.
        size_mm: f64,
        /// What was asked for.
        gap_mm: String,
        /// What is needed, rounded up to 0.01 mm.
        needed_mm: String,
    },
    /// The paper is too small.
    #[error("{0}")]
    DoesNotFit(Box<Misfit>),
    /// The paper holds no ruler.
    #[error(
        "paper of {width_mm} mm width with margins of {margin_mm} mm holds no ruler; the narrowest is {least_mm} mm wide"
    )]
    NoRuler {
        /// Width of the paper.
        width_mm: f64,
        /// Unprintable border.
        margin_mm: f64,
        /// Width that is needed.
        least_mm: f64,
    },
    /// Pixels too coarse for the tags.
    #[error(
        "a cell of {family} of {size_mm} mm is {cell_px:.2} pixels wide, and whole pixels would change the size by more than \
         5 %: raise the resolution, or choose a size of {nearest_mm} mm"
    )]
    Coarse {
        /// The family.
        family: crate::Family,
        /// Size of its tags.
        size_mm: f64,
        /// Width of a cell.
        cell_px: f64,
        /// Sizes that whole pixels give.
        nearest_mm: String,
    },
    /// An image that no program would open.
    #[error(
        "the image would have {width}×{height} pixels, and at most 2^28 are written: lower the resolution"
    )]
    TooLarge {
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// The built-in font is damaged.
    #[error("the font of captions cannot be read")]
    Font,
    /// The PNG encoder failed.
    #[error("PNG: {0}")]
    Png(String),
}
