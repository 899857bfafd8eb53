//! Black and white cells of a tag, from the AprilTag library's own tables.

use apriltag_sys as c;

use crate::family::{Family, Table};

/// A tag as a picture of square cells, row by row from its top left. It has the white ring around the border that
/// detectors need. Outside of the circle of round tags, where anything may be printed, cells are black.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TagBitmap {
    /// Cells along each side.
    pub cells: u32,
    /// Cells along each side of the square through the detected corners, which is in the middle.
    pub cells_between_corners: u32,
    /// `cells²` values.
    pub white: Vec<bool>,
    /// `cells²` values: whether the family says what is in a cell. Elsewhere (in the middle of tagCustom48h12, outside of
    /// the circle of round tags) anything may be printed.
    pub known: Vec<bool>,
}

/// Why there is no such tag.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TagError {
    /// The number is too large.
    #[error("{family} has no tag {id}: allowed are 0 to {}", family.tag_count() - 1)]
    Id {
        /// The family.
        family: Family,
        /// What was asked for.
        id: u32,
    },
    /// The library could not allocate its tables.
    #[error("{0}: the AprilTag library has no memory")]
    Memory(Family),
}

impl TagBitmap {
    /// Whether the cell at (column, row) is white; false outside.
    pub fn is_white(&self, column: u32, row: u32) -> bool {
        let inside = column < self.cells && row < self.cells;
        inside && self.white.get((row * self.cells + column) as usize).is_some_and(|white| *white)
    }

    /// Side of the whole bitmap for a tag whose detected corners are `size_m` apart.
    pub fn side_m(&self, size_m: f64) -> f64 {
        size_m * f64::from(self.cells) / f64::from(self.cells_between_corners)
    }
}

/// The cells of tag `id`.
///
/// # Errors
/// [`TagError`] for a number that the family does not have.
pub fn tag_bitmap(family: Family, id: u32) -> Result<TagBitmap, TagError> {
    if id >= family.tag_count() {
        return Err(TagError::Id { family, id });
    }
    let table = Table::new(family).ok_or(TagError::Memory(family))?;
    let cells = table.get().total_width.unsigned_abs();
    let cells_between_corners = table.get().width_at_border.unsigned_abs();
    // SAFETY: the table is alive, and `id` is below its number of codes, as the function asserts.
    let image = unsafe { c::apriltag_to_image(table.pointer(), id) };
    // SAFETY: null, or an image that only we know of and that nothing changes before it is freed below.
    let Some(picture) = (unsafe { image.as_ref() }) else {
        return Err(TagError::Memory(family));
    };
    let stride = picture.stride.unsigned_abs() as usize;
    // SAFETY: the library allocates `height · stride` bytes, all of them set (calloc).
    let bytes = unsafe { std::slice::from_raw_parts(picture.buf, stride * cells as usize) };
    let rows = bytes.chunks(stride.max(1));
    let white = rows.flat_map(|row| row.iter().take(cells as usize).map(|byte| *byte != 0)).collect();
    // SAFETY: made by the library, not used any more.
    unsafe { c::image_u8_destroy(image) };
    let known = known_cells(table.get(), cells, cells_between_corners);
    Ok(TagBitmap { cells, cells_between_corners, white, known })
}

/// The cells of the code, and the two rings on either side of the border.
fn known_cells(table: &c::apriltag_family_t, cells: u32, cells_between_corners: u32) -> Vec<bool> {
    let margin = (cells - cells_between_corners) / 2;
    let last = cells.saturating_sub(1);
    let ring = |column: u32, row: u32| column.min(row).min(last - column).min(last - row);
    let mut known: Vec<bool> = (0..cells * cells)
        .map(|cell| {
            let inset = ring(cell % cells, cell / cells);
            inset == margin || inset + 1 == margin
        })
        .collect();
    let bits = table.nbits as usize;
    // SAFETY: the library allocates `nbits` places along each axis, and the table outlives this function.
    let (columns, rows) = unsafe {
        (std::slice::from_raw_parts(table.bit_x, bits), std::slice::from_raw_parts(table.bit_y, bits))
    };
    for (column, row) in columns.iter().zip(rows) {
        // Counted from the border, with negative numbers (outside of it) wrapped around.
        let (column, row) = (column.wrapping_add(margin), row.wrapping_add(margin));
        if column < cells
            && row < cells
            && let Some(known) = known.get_mut((row * cells + column) as usize)
        {
            *known = true;
        }
    }
    known
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_white_cells_are_the_bits_of_the_code() {
        // First entry of the table in tag36h11.c: 36 bits, of which the border adds 36 white cells around.
        let code: u64 = 0x0000_000d_7e00_984b;
        let tag = tag_bitmap(Family::Tag36h11, 0).unwrap();
        assert_eq!((tag.cells, tag.cells_between_corners), (10, 8));
        assert_eq!(tag.white.iter().filter(|white| **white).count() as u32, code.count_ones() + 36);
    }

    #[test]
    fn every_family_has_a_border_of_one_colour_against_the_other() {
        for family in Family::ALL {
            for id in [0, family.tag_count() - 1] {
                let tag = tag_bitmap(family, id).unwrap();
                let margin = (tag.cells - tag.cells_between_corners) / 2;
                let ring = |inset: u32| {
                    let (low, high) = (inset, tag.cells - 1 - inset);
                    let sides = (low..=high).flat_map(move |i| [(i, low), (i, high), (low, i), (high, i)]);
                    sides.map(|(x, y)| tag.is_white(x, y)).collect::<Vec<_>>()
                };
                // The detected square is between the last cell ring outside of it and the first within.
                let (outside, within) = (ring(margin - 1), ring(margin));
                assert!(outside.windows(2).all(|pair| pair[0] == pair[1]), "{family} {id}");
                assert!(within.windows(2).all(|pair| pair[0] == pair[1]), "{family} {id}");
                assert_ne!(outside[0], within[0], "{family} {id}");
            }
            let last = family.tag_count();
            assert_eq!(tag_bitmap(family, last), Err(TagError::Id { family, id: last }));
        }
    }

    #[test]
    fn what_may_be_anything_is_not_known() {
        let unknown = |family| tag_bitmap(family, 1).unwrap().known.iter().filter(|known| !**known).count();
        // All cells of the classic family are bits or border.
        assert_eq!(unknown(Family::Tag36h11), 0);
        // Four corners of 81 cells lie outside of a circle; the middle of the custom family holds 2 × 2 cells.
        assert!(unknown(Family::Circle21h7) > 0);
        assert_eq!(unknown(Family::Custom48h12), 4);
    }

    #[test]
    fn sizes_are_between_detected_corners() {
        assert!((tag_bitmap(Family::Tag36h11, 3).unwrap().side_m(0.08) - 0.1).abs() < 1e-15);
    }
}
