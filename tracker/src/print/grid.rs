//! Sizes of tags and the places between them.

use crate::bitmap::{TagBitmap, tag_bitmap};
use crate::board::{Board, BoardProvenance, BoardTag, VERSION};

use super::{PROGRAM, PrintError, PrintSpec};

/// Rounding of sums of millimetres.
const EPSILON_MM: f64 = 1e-9;
/// Whole pixels may change sizes by this share.
const MOST_ROUNDING: f64 = 0.05;

/// Tags in rows, as they are printed. Lengths are millimetres.
#[derive(Clone, Debug, PartialEq)]
pub struct TagGrid {
    /// Tags in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Side of a cell.
    pub cell_mm: f64,
    /// Side of the square through a tag's detected corners.
    pub size_mm: f64,
    /// From a tag to its neighbour.
    pub pitch_mm: f64,
    /// From the square through the corners to the outer edge of the white ring that detectors need.
    pub quiet_mm: f64,
    /// How far black reaches beyond that square.
    pub overhang_mm: f64,
}

impl TagGrid {
    /// Checks the lengths, and rounds them to whole pixels where there is a raster.
    pub(super) fn new(spec: &PrintSpec) -> Result<Self, PrintError> {
        check(spec)?;
        let first = spec.ids.first().ok_or(PrintError::NoTags)?;
        let bitmap = tag_bitmap(spec.family, *first)?;
        let between = f64::from(bitmap.cells_between_corners);
        let cell_mm = whole_pixels_of_cell(spec, between)?;
        let (quiet_cells, overhang_cells) = rings(&bitmap);
        let needed_mm = 2.0 * quiet_cells * cell_mm;
        let gap_mm = match spec.gap_mm {
            None => needed_mm,
            Some(gap_mm) => {
                let needed_mm = 2.0 * quiet_cells * spec.size_mm / between;
                if gap_mm + EPSILON_MM < needed_mm && spec.ids.len() > 1 {
                    return Err(narrow(spec, gap_mm, needed_mm));
                }
                gap_mm
            }
        };
        let size_mm = between * cell_mm;
        // Rounding takes nothing of the white rings.
        let gap_mm = snapped(spec.px_per_m, gap_mm).max(needed_mm);
        Ok(Self {
            columns: spec.columns,
            rows: spec.ids.len() / spec.columns,
            cell_mm,
            size_mm,
            pitch_mm: size_mm + gap_mm,
            quiet_mm: quiet_cells * cell_mm,
            overhang_mm: overhang_cells * cell_mm,
        })
    }

    /// Between the squares of neighbours.
    pub fn gap_mm(&self) -> f64 {
        self.pitch_mm - self.size_mm
    }

    /// Width and height of all squares together, from corner to corner.
    pub fn squares_mm(&self) -> [f64; 2] {
        [self.columns, self.rows].map(|count| (count.max(1) - 1) as f64 * self.pitch_mm + self.size_mm)
    }

    /// The same with the white rings.
    pub fn footprint_mm(&self) -> [f64; 2] {
        self.squares_mm().map(|side| side + 2.0 * self.quiet_mm)
    }

    /// The upper left corner of a tag's square, right and down from that of the first.
    pub(super) fn square_mm(&self, index: usize) -> [f64; 2] {
        [index % self.columns, index / self.columns].map(|count| count as f64 * self.pitch_mm)
    }

    /// What is printed, as a board: origin in the middle, y up.
    pub(super) fn board(&self, spec: &PrintSpec) -> Board {
        let [width, height] = self.squares_mm();
        let tag = |(index, id): (usize, &u32)| {
            let [x, y] = self.square_mm(index);
            let half = self.size_mm / 2.0;
            BoardTag::flat(
                *id,
                meters(self.size_mm),
                [meters(x + half - width / 2.0), meters(height / 2.0 - y - half)],
            )
        };
        let notes = "As drawn, not measured: if 100 mm of the printed ruler measure L mm, multiply all lengths by L/100";
        Board {
            version: VERSION,
            family: spec.family,
            tags: spec.ids.iter().enumerate().map(tag).collect(),
            provenance: Some(BoardProvenance {
                tool: Some(PROGRAM.to_owned()),
                notes: Some(notes.to_owned()),
                ..BoardProvenance::default()
            }),
        }
    }
}

/// To whole nanometres, so that files hold no digits of rounding.
fn meters(length_mm: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (length_mm * 1e6).round() / 1e9 + 0.0
}

/// The nearest whole pixel.
pub(super) fn snapped(px_per_m: Option<u32>, length_mm: f64) -> f64 {
    match px_per_m {
        Some(px_per_m) => {
            let px_per_mm = f64::from(px_per_m) / 1000.0;
            (length_mm * px_per_mm).round() / px_per_mm
        }
        None => length_mm,
    }
}

/// Cells from the square through the corners outwards: to the outer edge of the white ring, and to that of the black cells.
/// Classic families have the white ring in their bitmaps; those with bits outside of the border need one more around.
fn rings(bitmap: &TagBitmap) -> (f64, f64) {
    let outside = (bitmap.cells - bitmap.cells_between_corners) / 2;
    match outside {
        0 | 1 => (1.0, 0.0),
        bits => (f64::from(bits + 1), f64::from(bits)),
    }
}

fn whole_pixels_of_cell(spec: &PrintSpec, between: f64) -> Result<f64, PrintError> {
    let cell_mm = spec.size_mm / between;
    let Some(px_per_m) = spec.px_per_m else { return Ok(cell_mm) };
    let px_per_mm = f64::from(px_per_m) / 1000.0;
    let cell_px = cell_mm * px_per_mm;
    let whole_px = cell_px.round().max(1.0);
    if (whole_px / cell_px - 1.0).abs() > MOST_ROUNDING {
        let size = |px: f64| millimeters(px.max(1.0) * between / px_per_mm);
        let nearest_mm = if cell_px < 1.0 {
            size(1.0)
        } else {
            format!("{} or {}", size(cell_px.floor()), size(cell_px.ceil()))
        };
        return Err(PrintError::Coarse { family: spec.family, size_mm: spec.size_mm, cell_px, nearest_mm });
    }
    Ok(whole_px / px_per_mm)
}

fn narrow(spec: &PrintSpec, gap_mm: f64, needed_mm: f64) -> PrintError {
    PrintError::Gap {
        family: spec.family,
        size_mm: spec.size_mm,
        gap_mm: millimeters(gap_mm),
        needed_mm: millimeters((needed_mm * 100.0 - EPSILON_MM).ceil() / 100.0),
    }
}

/// With at most three decimals.
pub(super) fn millimeters(length_mm: f64) -> String {
    ((length_mm * 1000.0).round() / 1000.0).to_string()
}

fn check(spec: &PrintSpec) -> Result<(), PrintError> {
    let count = spec.ids.len();
    if count == 0 || spec.columns == 0 {
        return Err(PrintError::NoTags);
    }
    if count > 4096 {
        return Err(PrintError::TooManyTags { count });
    }
    if !count.is_multiple_of(spec.columns) {
        return Err(PrintError::Rows { tags: count, columns: spec.columns });
    }
    let mut seen = std::collections::HashSet::new();
    for id in &spec.ids {
        if *id >= spec.family.tag_count() {
            return Err(crate::TagError::Id { family: spec.family, id: *id }.into());
        }
        if !seen.insert(*id) {
            return Err(PrintError::Twice { id: *id });
        }
    }
    length("size", spec.size_mm, 0.5..=5000.0, "0.5 to 5000 mm")?;
    length("gap", spec.gap_mm.unwrap_or(0.0), 0.0..=5000.0, "0 to 5000 mm")?;
    length("margin", spec.margin_mm, 0.0..=100.0, "0 to 100 mm")?;
    let px_per_m = f64::from(spec.px_per_m.unwrap_or(1000));
    length("pixels per metre", px_per_m, 1000.0..=400_000.0, "1000 to 400000 (25 to 10000 dpi)")
}

fn length(
    name: &'static str,
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    allowed: &'static str,
) -> Result<(), PrintError> {
    if range.contains(&value) { Ok(()) } else { Err(PrintError::Length { name, value, allowed }) }
}
