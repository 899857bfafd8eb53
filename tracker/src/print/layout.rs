//! From what is to be printed to shapes on paper.

use crate::bitmap::tag_bitmap;
use crate::board::Board;

use super::drawing::{Contour, Drawing, Path};
use super::fit::{Content, Place, place};
use super::grid::TagGrid;
use super::outline::outlines;
use super::text::{Anchor, Letters};
use super::{PrintError, PrintSpec, caption, ruler};

/// Numbers under tags: share of the tags' size, and limits of their letters.
const LABEL_SHARE: f64 = 0.08;
const LABEL_EM_MM: [f64; 2] = [1.5, 5.0];
/// Height of a line of numbers, with space around, in units of its letters.
const LABEL_LINE: f64 = 1.3;

/// A laid-out sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Everything on it.
    pub drawing: Drawing,
    /// The tags on it, where they are and how large: whole pixels where there is a raster.
    pub board: Board,
    /// Sizes of and between tags.
    pub grid: TagGrid,
    /// Upper left corner of the first tag's square, right and down from that of the paper.
    pub first_square_mm: [f64; 2],
    /// Whether the tags' numbers are under them.
    pub has_labels: bool,
    /// Length of the level ruler.
    pub ruler_mm: f64,
    /// Length of the upright ruler, if there was room for one.
    pub upright_ruler_mm: Option<f64>,
}

impl Sheet {
    /// Lays out a sheet.
    ///
    /// # Errors
    /// [`PrintError`] for tags that do not exist, lengths out of range, tags too close to each other, paper too small
    /// (by how much, and what would fit), pixels too coarse.
    pub fn new(spec: &PrintSpec) -> Result<Self, PrintError> {
        let grid = TagGrid::new(spec)?;
        let letters = Letters::new()?;
        let label_em_mm = label_em_mm(spec, &grid);
        let text = caption::text(spec, &grid);
        let caption = |paper_mm: f64| letters.wrapped(&text, caption::EM_MM, paper_mm - 2.0 * spec.margin_mm);
        let content = Content {
            grid: &grid,
            labels_mm: label_em_mm.map_or(0.0, |em| em * LABEL_LINE),
            caption_lines: &|paper_mm| caption(paper_mm).len(),
        };
        let place = place(spec, content)?;
        let mut paths = tags(spec, &grid, &place)?;
        if let Some(em_mm) = label_em_mm {
            paths.extend(labels(spec, &grid, &place, &letters, em_mm));
        }
        paths.extend(footer(spec, &place, &letters, &caption(place.paper_mm[0])));
        let title = format!("{} board", spec.family);
        Ok(Self {
            drawing: Drawing { title, size_mm: place.paper_mm, paths },
            board: grid.board(spec),
            first_square_mm: place.squares_mm,
            has_labels: label_em_mm.is_some(),
            ruler_mm: place.ruler_mm,
            upright_ruler_mm: place.upright_ruler_mm.map(|[_, length]| length),
            grid,
        })
    }
}

/// Size of the numbers' letters: as large as fits between white rings. `None`: no numbers.
fn label_em_mm(spec: &PrintSpec, grid: &TagGrid) -> Option<f64> {
    let [least, most] = LABEL_EM_MM;
    let between_rings = match grid.rows {
        0 | 1 => f64::INFINITY,
        _ => grid.gap_mm() - 2.0 * grid.quiet_mm,
    };
    let em_mm = (grid.size_mm * LABEL_SHARE).clamp(least, most).min(between_rings / LABEL_LINE);
    (spec.labels && em_mm >= least).then_some(em_mm)
}

fn tags(spec: &PrintSpec, grid: &TagGrid, place: &Place) -> Result<Vec<Path>, PrintError> {
    let tag = |(index, id): (usize, &u32)| {
        let bitmap = tag_bitmap(spec.family, *id)?;
        let outside = (bitmap.cells - bitmap.cells_between_corners) / 2;
        let square = grid.square_mm(index);
        let corner = |[column, row]: [u32; 2]| {
            let along = |axis: usize, cells: u32| {
                let cells = f64::from(cells) - f64::from(outside);
                place.squares_mm[axis] + square[axis] + cells * grid.cell_mm
            };
            [along(0, column), along(1, row)]
        };
        let contours = outlines(&bitmap).into_iter().filter_map(|outline| {
            let corners: Vec<[f64; 2]> = outline.into_iter().map(corner).collect();
            Contour::polygon(&corners)
        });
        Ok(Path { name: format!("{} {id}", spec.family), contours: contours.collect() })
    };
    spec.ids.iter().enumerate().map(tag).collect()
}

/// The number of each tag, under its white ring.
fn labels(spec: &PrintSpec, grid: &TagGrid, place: &Place, letters: &Letters, em_mm: f64) -> Vec<Path> {
    let label = |(index, id): (usize, &u32)| {
        let [x, y] = grid.square_mm(index);
        let middle = place.squares_mm[0] + x + grid.size_mm / 2.0;
        let baseline = place.squares_mm[1] + y + grid.size_mm + grid.quiet_mm + em_mm;
        letters.line(&id.to_string(), [middle, baseline], em_mm, Anchor::Middle)
    };
    spec.ids.iter().enumerate().map(label).collect()
}

/// Rulers, caption and arrow.
fn footer(spec: &PrintSpec, place: &Place, letters: &Letters, lines: &[String]) -> Vec<Path> {
    let left = spec.margin_mm;
    let right = place.paper_mm[0] - spec.margin_mm;
    let mut paths = ruler::level(letters, [left + ruler::BEYOND_MM, place.footer_mm], place.ruler_mm);
    if let Some([top, length]) = place.upright_ruler_mm {
        paths.extend(ruler::upright(letters, [left, top], length));
    }
    paths.extend(caption::up_arrow(letters, [right, place.footer_mm]));
    paths.extend(caption::lines(letters, lines, left, place.footer_mm));
    paths
}
