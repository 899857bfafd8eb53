//! Tags on paper, true to scale: what `coshade board` draws.
//!
//! [`Sheet::new`] lays out tags, their numbers, rulers and a caption as one [`Drawing`] of black shapes in millimetres, which
//! is written as PDF, SVG or PNG. The board that comes with it is what the paper shows.

mod caption;
mod drawing;
mod error;
mod fit;
mod grid;
mod layout;
mod outline;
mod paper;
mod pdf;
mod png;
mod ruler;
mod svg;
mod text;

pub use drawing::{Contour, Drawing, Path, Segment};
pub use error::PrintError;
pub use fit::Misfit;
pub use grid::TagGrid;
pub use layout::Sheet;
pub use paper::{Paper, PaperError};

use crate::family::Family;

/// Program and version, as files and captions name it.
const PROGRAM: &str = concat!("coshade ", env!("CARGO_PKG_VERSION"));

/// What to print.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintSpec {
    /// Family of all tags.
    pub family: Family,
    /// The tags, row by row from the upper left.
    pub ids: Vec<u32>,
    /// Tags in a row.
    pub columns: usize,
    /// Side of the square through a tag's detected corners, millimetres.
    pub size_mm: f64,
    /// Between the squares of neighbours, millimetres. `None`: the least that leaves each tag its white ring.
    pub gap_mm: Option<f64>,
    /// What it is printed on.
    pub paper: Paper,
    /// Border of the paper that printers leave white, millimetres.
    pub margin_mm: f64,
    /// Whether each tag's number is printed under it, where there is room outside of the white rings.
    pub labels: bool,
    /// Pixels per metre of a raster: sizes and places of tags become whole pixels. `None`: no raster.
    pub px_per_m: Option<u32>,
}
