//! Printed sheets: what is drawn against the board that goes with it, and each kind of file against the drawing.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

mod detected;
mod files;
mod layout;

use coshade_tracker::Family;
use coshade_tracker::print::{Paper, PrintSpec, Sheet};

/// 4 × 3 tags of 41 mm, 52 mm apart, on A4 in landscape.
fn desk_board() -> PrintSpec {
    PrintSpec {
        family: Family::Tag36h11,
        ids: (0..12).collect(),
        columns: 4,
        size_mm: 41.0,
        gap_mm: Some(11.0),
        paper: paper("a4").landscape(),
        margin_mm: 5.0,
        labels: true,
        px_per_m: None,
    }
}

fn paper(name: &str) -> Paper {
    name.parse().unwrap()
}

/// Upper left and lower right corner of each tag's square on the paper, by the board.
fn squares_mm(sheet: &Sheet) -> Vec<[[f64; 2]; 2]> {
    let [width, height] = sheet.grid.squares_mm();
    let [left, top] = sheet.first_square_mm;
    let square = |tag: &coshade_tracker::BoardTag| {
        let (x, y) = (tag.position_m[0] * 1e3, tag.position_m[1] * 1e3);
        let half = tag.size_m * 1e3 / 2.0;
        let middle = [left + width / 2.0 + x, top + height / 2.0 - y];
        [middle.map(|place| place - half), middle.map(|place| place + half)]
    };
    sheet.board.tags.iter().map(square).collect()
}
