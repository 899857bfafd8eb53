//! What is written under a board.

use super::drawing::{Contour, Path};
use super::grid::{TagGrid, millimeters};
use super::ruler;
use super::text::{Anchor, Letters};
use super::{PROGRAM, PrintSpec};

/// Size of letters.
pub(super) const EM_MM: f64 = 2.8;
/// From line to line.
const LINE_MM: f64 = 3.8;
/// Runs of numbers that a caption lists; the board file has all of them.
const MOST_RUNS: usize = 12;

/// Height of ruler and caption.
pub(super) fn height_mm(lines: usize) -> f64 {
    ruler::LEVEL_MM + lines as f64 * LINE_MM
}

/// What the tags are, how large they are, how to print them.
pub(super) fn text(spec: &PrintSpec, grid: &TagGrid) -> String {
    let several = spec.ids.len() > 1;
    let order = if several && spec.columns > 1 { " from the upper left, row by row" } else { "" };
    let pitch = if several { format!(", pitch {} mm", millimeters(grid.pitch_mm)) } else { String::new() };
    let name = if several { "tags" } else { "tag" };
    let edge = match grid.overhang_mm > 0.0 {
        true => "between detected corners, the inner edge of the black ring",
        false => "between detected corners, the outer edge of the black square",
    };
    format!(
        "{} {name} {}{order}: {} mm {edge}{pitch}. Print at 100 %, not fitted to the page, and measure the ruler. {}",
        spec.family,
        ids(&spec.ids),
        millimeters(grid.size_mm),
        PROGRAM.replace(' ', "\u{a0}")
    )
}

/// Such as `0–11, 20`.
fn ids(ids: &[u32]) -> String {
    let runs: Vec<String> = ids
        .chunk_by(|a, b| a.checked_add(1) == Some(*b))
        .map(|run| match *run {
            [first, .., last] => format!("{first}–{last}"),
            [only] => only.to_string(),
            [] => String::new(),
        })
        .collect();
    match runs.get(..MOST_RUNS) {
        Some(first) if runs.len() > MOST_RUNS => format!("{}, … ({} in all)", first.join(", "), ids.len()),
        _ => runs.join(", "),
    }
}

/// The lines, below the ruler that begins at `top_mm`.
pub(super) fn lines(letters: &Letters, lines: &[String], left_mm: f64, top_mm: f64) -> Vec<Path> {
    let baseline = |number: usize| top_mm + ruler::LEVEL_MM + EM_MM + number as f64 * LINE_MM;
    let line = |(number, text): (usize, &String)| {
        letters.line(text, [left_mm, baseline(number)], EM_MM, Anchor::Start)
    };
    lines.iter().enumerate().map(line).collect()
}

/// An arrow along the board's y axis, left of its upper right corner, with its name.
pub(super) fn up_arrow(letters: &Letters, [right, top]: [f64; 2]) -> Vec<Path> {
    let corners = [[-1.5, 0.0], [0.0, 2.8], [-1.1, 2.8], [-1.1, 6.2], [-1.9, 6.2], [-1.9, 2.8], [-3.0, 2.8]];
    let arrow = Contour::polygon(&corners.map(|[x, y]| [right + x, top + y]));
    let arrow = Path { name: "up".to_owned(), contours: arrow.into_iter().collect() };
    let width = letters.width_mm("up", EM_MM);
    vec![arrow, letters.line("up", [right - 3.8 - width, top + 5.0], EM_MM, Anchor::Start)]
}

#[cfg(test)]
mod tests {
    #[test]
    fn numbers_are_listed_in_runs() {
        let ids = super::ids;
        assert_eq!(ids(&[7]), "7");
        assert_eq!(ids(&[0, 1, 2, 5, 9, 8]), "0–2, 5, 9, 8");
        assert_eq!(ids(&[u32::MAX, 0]), "4294967295, 0");
        let many: Vec<u32> = (0..40).map(|id| id * 2).collect();
        assert!(ids(&many).ends_with("22, … (40 in all)"), "{}", ids(&many));
    }
}
