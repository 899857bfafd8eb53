//! Where the board goes on the paper, and what helps where it does not fit.

use std::fmt;

use super::grid::{TagGrid, millimeters, snapped};
use super::paper::{Paper, SIDES_MM};
use super::ruler::{self, RULER_MM, STEP_MM};
use super::{PrintError, PrintSpec, caption};

/// White between the board and what is under it.
const SPACE_MM: f64 = 1.5;

/// Where things are on the paper.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place {
    pub paper_mm: [f64; 2],
    /// Upper left corner of the first tag's square.
    pub squares_mm: [f64; 2],
    /// Upper edge of ruler and caption.
    pub footer_mm: f64,
    pub ruler_mm: f64,
    /// Its upper edge and length, if there is room for it.
    pub upright_ruler_mm: Option<[f64; 2]>,
}

/// How much there is to be placed.
#[derive(Clone, Copy)]
pub(super) struct Content<'a> {
    pub grid: &'a TagGrid,
    /// Height of the numbers under the last row.
    pub labels_mm: f64,
    /// Lines of the caption on paper of a width.
    pub caption_lines: &'a dyn Fn(f64) -> usize,
}

/// A board that is larger than its paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Misfit {
    paper: String,
    needed_mm: [f64; 2],
    room_mm: [f64; 2],
    remedies: Vec<String>,
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tenths = |[width, height]: [f64; 2]| format!("{width:.1} × {height:.1} mm");
        let (needed, room) = (tenths(self.needed_mm), tenths(self.room_mm));
        write!(
            f,
            "tags and white rings of {needed} do not fit {}, which has room for {room} beside ruler and caption: ",
            self.paper
        )?;
        let over = ["wide", "high"].into_iter().zip(self.needed_mm.iter().zip(self.room_mm));
        let over = over.filter(|(_, (needed, room))| **needed > *room);
        // Rounded up: what is cut off by 0.01 mm is not "0.0 mm too wide".
        let over: Vec<String> = over
            .map(|(what, (needed, room))| {
                format!("{:.1} mm too {what}", ((needed - room) * 10.0).ceil() / 10.0)
            })
            .collect();
        write!(f, "{}", over.join(" and "))?;
        match self.remedies.is_empty() {
            true => Ok(()),
            false => write!(f, "; it fits {}", self.remedies.join(", or ")),
        }
    }
}

/// Places everything.
pub(super) fn place(spec: &PrintSpec, content: Content<'_>) -> Result<Place, PrintError> {
    let size_mm = match &spec.paper {
        Paper::Sheet { size_mm, .. } => *size_mm,
        Paper::Fit => fitting_paper(spec, content),
    };
    // The limit of PDF pages is 5080 mm.
    if let Some(value) = size_mm.into_iter().find(|side| !SIDES_MM.contains(side)) {
        return Err(PrintError::Length { name: "paper", value, allowed: "20 to 5000 mm a side" });
    }
    let least_mm = 2.0 * spec.margin_mm + ruler::WIDTH_BESIDE_MM + 2.0 * STEP_MM;
    if size_mm[0] < least_mm {
        return Err(PrintError::NoRuler { width_mm: size_mm[0], margin_mm: spec.margin_mm, least_mm });
    }
    try_place(spec, content, size_mm).map_err(|room_mm| {
        PrintError::DoesNotFit(Box::new(Misfit {
            paper: spec.paper.to_string(),
            needed_mm: needed_mm(content),
            room_mm,
            remedies: remedies(spec, content, size_mm),
        }))
    })
}

fn needed_mm(content: Content<'_>) -> [f64; 2] {
    let [width, height] = content.grid.footprint_mm();
    [width, height + content.labels_mm]
}

/// In whole millimetres, with room for both rulers.
fn fitting_paper(spec: &PrintSpec, content: Content<'_>) -> [f64; 2] {
    let [width, height] = needed_mm(content);
    let level = RULER_MM + ruler::WIDTH_BESIDE_MM;
    let width = (2.0 * spec.margin_mm + level.max(ruler::UPRIGHT_MM + width)).ceil();
    let footer = caption::height_mm((content.caption_lines)(width));
    [width, (2.0 * spec.margin_mm + height + SPACE_MM + footer).ceil()]
}

/// What is between the edges of the paper that the white rings may reach: black stays off the unprintable border, white
/// need not.
fn try_place(spec: &PrintSpec, content: Content<'_>, paper_mm: [f64; 2]) -> Result<Place, [f64; 2]> {
    let grid = content.grid;
    let margin = spec.margin_mm;
    let border = (margin - (grid.quiet_mm - grid.overhang_mm)).max(0.0);
    let footer_mm = paper_mm[1] - margin - caption::height_mm((content.caption_lines)(paper_mm[0]));
    let [width, height] = needed_mm(content);
    let room_mm = [paper_mm[0] - 2.0 * border, footer_mm - SPACE_MM - border].map(|side| side.max(0.0));
    if width > room_mm[0] || height > room_mm[1] {
        return Err(room_mm);
    }
    let centered = (paper_mm[0] - width) / 2.0;
    let beside_ruler = margin + ruler::UPRIGHT_MM;
    let is_beside = beside_ruler + width <= border + room_mm[0];
    let left = if is_beside { centered.max(beside_ruler) } else { centered };
    let top = border + (room_mm[1] - height) / 2.0;
    // Beside the board where there is room, else under it.
    let highest = if is_beside { margin } else { top + height };
    let lowest = footer_mm - SPACE_MM - ruler::BEYOND_MM;
    let upright_ruler_mm =
        ruler::length_mm(lowest - highest - ruler::BEYOND_MM).map(|length| [lowest - length, length]);
    // The caller has made sure that the paper is wide enough.
    let ruler_mm = ruler::length_mm(paper_mm[0] - 2.0 * margin - ruler::WIDTH_BESIDE_MM).ok_or(room_mm)?;
    let squares_mm = [left, top].map(|edge| snapped(spec.px_per_m, edge + grid.quiet_mm));
    Ok(Place { paper_mm, squares_mm, footer_mm, ruler_mm, upright_ruler_mm })
}

/// What would fit: the paper turned, or else larger paper; smaller tags.
fn remedies(spec: &PrintSpec, content: Content<'_>, [width, height]: [f64; 2]) -> Vec<String> {
    let fits = |size_mm: [f64; 2]| try_place(spec, content, size_mm).is_ok();
    let turned =
        fits([height, width]).then(|| if height > width { "in landscape" } else { "upright" }.to_owned());
    let larger = spec.paper.alternatives().into_iter().find_map(|paper| match paper {
        Paper::Sheet { name, size_mm: [width, height] } => {
            let upright = fits([width, height]).then(|| format!("on {name}"));
            upright.or_else(|| fits([height, width]).then(|| format!("on {name} in landscape")))
        }
        Paper::Fit => None,
    });
    let smaller = smaller_size(spec, content, [width, height]);
    turned.or(larger).into_iter().chain(smaller).collect()
}

/// The largest size, in tenths of a millimetre, at which the same tags fit with a gap of the same share.
fn smaller_size(spec: &PrintSpec, content: Content<'_>, paper_mm: [f64; 2]) -> Option<String> {
    let share = content.grid.gap_mm() / content.grid.size_mm;
    let fits = |tenths: u32| {
        let size_mm = f64::from(tenths) / 10.0;
        let scaled = PrintSpec { size_mm, gap_mm: Some(size_mm * share), px_per_m: None, ..spec.clone() };
        TagGrid::new(&scaled)
            .is_ok_and(|grid| try_place(&scaled, Content { grid: &grid, ..content }, paper_mm).is_ok())
    };
    // Fitting ends somewhere between 0.5 mm and the size that does not fit.
    let (mut fitting, mut too_large) = (5, (spec.size_mm * 10.0).ceil() as u32);
    if !fits(fitting) {
        return None;
    }
    while too_large > fitting + 1 {
        let middle = fitting.midpoint(too_large);
        if fits(middle) { fitting = middle } else { too_large = middle }
    }
    let size_mm = f64::from(fitting) / 10.0;
    let gap = if spec.gap_mm.is_some() {
        format!(" and a gap of {} mm", millimeters(size_mm * share))
    } else {
        String::new()
    };
    Some(format!("with a size of {size_mm} mm{gap}"))
}
