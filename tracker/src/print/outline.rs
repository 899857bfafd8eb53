//! Outlines of black cells: merged, so that no hairlines show between cells.

use std::collections::BTreeMap;

use crate::bitmap::TagBitmap;

/// A corner of cells: columns right of and rows below the upper left corner.
type Corner = [u32; 2];

/// The outlines of all black cells whose colour the family states, as corners in cells. Black is on the right of the way,
/// so holes wind against the outside. Cells that may be anything stay white.
pub(super) fn outlines(tag: &TagBitmap) -> Vec<Vec<Corner>> {
    let mut edges = edges(tag);
    let mut outlines = Vec::new();
    while let Some((&start, _)) = edges.first_key_value() {
        let mut outline = vec![start];
        let mut here = start;
        while let Some(next) = take_edge(&mut edges, here) {
            if next == start && !edges.contains_key(&start) {
                break;
            }
            outline.push(next);
            here = next;
        }
        outlines.push(without_flat_corners(&outline));
    }
    outlines
}

/// The sides of black cells towards white ones, by where they begin.
fn edges(tag: &TagBitmap) -> BTreeMap<Corner, Vec<Corner>> {
    let cells = tag.cells;
    let black = |x: u32, y: u32| {
        let inside = x < cells && y < cells;
        let known = |index: u32| tag.known.get(index as usize).is_some_and(|known| *known);
        inside && known(y * cells + x) && !tag.is_white(x, y)
    };
    let mut edges: BTreeMap<Corner, Vec<Corner>> = BTreeMap::new();
    for (x, y) in (0..cells).flat_map(|y| (0..cells).map(move |x| (x, y))).filter(|&(x, y)| black(x, y)) {
        let sides = [
            (black(x, y.wrapping_sub(1)), [x, y], [x + 1, y]),
            (black(x + 1, y), [x + 1, y], [x + 1, y + 1]),
            (black(x, y + 1), [x + 1, y + 1], [x, y + 1]),
            (black(x.wrapping_sub(1), y), [x, y + 1], [x, y]),
        ];
        for (_, from, to) in sides.into_iter().filter(|(inside, ..)| !inside) {
            edges.entry(from).or_default().push(to);
        }
    }
    edges
}

fn take_edge(edges: &mut BTreeMap<Corner, Vec<Corner>>, from: Corner) -> Option<Corner> {
    let ends = edges.get_mut(&from)?;
    let end = ends.pop();
    if ends.is_empty() {
        edges.remove(&from);
    }
    end
}

/// Only the corners where the way turns.
fn without_flat_corners(outline: &[Corner]) -> Vec<Corner> {
    let count = outline.len();
    let at = |index: usize| outline.get(index % count).copied().unwrap_or_default();
    let turns = |index: &usize| {
        let [before, here, after] = [at(index + count - 1), at(*index), at(index + 1)];
        (0..2).all(|axis| !(before[axis] == here[axis] && here[axis] == after[axis]))
    };
    (0..count).filter(turns).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Family, tag_bitmap};

    /// How often the outlines wind around the middle of a cell.
    fn winding(outlines: &[Vec<Corner>], [x, y]: [u32; 2]) -> i32 {
        let mut winding = 0;
        for outline in outlines {
            for (from, to) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                // Vertical sides left of the cell's middle, at its height.
                let spans = from[1].min(to[1]) <= y && y < from[1].max(to[1]);
                if from[0] == to[0] && from[0] <= x && spans {
                    winding += if to[1] > from[1] { -1 } else { 1 };
                }
            }
        }
        winding
    }

    #[test]
    fn outlines_wind_once_around_black_cells_and_not_around_others() {
        for family in Family::ALL {
            for id in [0, 1, family.tag_count() - 1] {
                let tag = tag_bitmap(family, id).unwrap();
                let outlines = outlines(&tag);
                for (index, (white, known)) in tag.white.iter().zip(&tag.known).enumerate() {
                    let cell = [index as u32 % tag.cells, index as u32 / tag.cells];
                    assert_eq!(
                        winding(&outlines, cell),
                        i32::from(*known && !white),
                        "{family} {id} {cell:?}"
                    );
                }
                for outline in &outlines {
                    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
                    for (number, (from, to)) in sides.enumerate() {
                        let vertical = from[0] == to[0];
                        assert!(vertical != (from[1] == to[1]), "a side is level or upright");
                        let first_vertical = outline[0][0] == outline[1][0];
                        assert_eq!(vertical, first_vertical == (number % 2 == 0), "every corner turns");
                    }
                }
            }
        }
    }
}
