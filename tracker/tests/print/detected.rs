//! Printed tags are found, where the board says.

use coshade_lens::response::Response;
use coshade_tracker::detector::{Detector, DetectorSettings, FindTags};
use coshade_tracker::print::{PrintSpec, Sheet};
use coshade_tracker::refine::{RefineSettings, Refiner};
use coshade_tracker::{Board, Family, Luma, UNIT_CORNERS};
use nalgebra::Vector2;

use crate::files::decoded;
use crate::{desk_board, paper};

/// Pixels a metre: 150 dpi.
const PX_PER_M: u32 = 5906;

/// The corners of a tag in the image, in camera coordinates, by the board file alone.
fn corners_px(sheet: &Sheet, board: &Board, index: usize) -> [Vector2<f64>; 4] {
    let px_per_mm = f64::from(PX_PER_M) / 1e3;
    let [width, height] = sheet.grid.squares_mm();
    let [left, top] = sheet.first_square_mm;
    let corners_m = board.placed_tags().unwrap()[index].corners_m();
    corners_m.map(|corner| {
        let [x_mm, y_mm] = [left + width / 2.0 + corner.x * 1e3, top + height / 2.0 - corner.y * 1e3];
        // Pixel 0 reaches from 0 to 1; in camera coordinates its middle is at 0.
        Vector2::new(x_mm * px_per_mm - 0.5, y_mm * px_per_mm - 0.5)
    })
}

#[test]
fn all_tags_are_found_where_the_board_says() {
    assert_eq!(UNIT_CORNERS[0], [-0.5, -0.5]);
    for family in Family::ALL {
        let spec = PrintSpec {
            family,
            ids: vec![0, 5, 9, 2, 1, 7],
            columns: 2,
            size_mm: 25.0,
            gap_mm: None,
            paper: paper("a4"),
            px_per_m: Some(PX_PER_M),
            ..desk_board()
        };
        let sheet = Sheet::new(&spec).unwrap();
        let (width, height, levels, _) = decoded(&sheet.drawing.to_png(PX_PER_M).unwrap());
        let image = Luma::new(&levels, width as u32, height as u32, width as u32).unwrap();
        let settings = DetectorSettings {
            families: vec![family],
            decimate: 1.0,
            // Without it, letters and rulers look like tag16h5.
            max_hamming: 0,
            ..DetectorSettings::default()
        };
        let found = Detector::new(&settings).unwrap().find(&image).unwrap();
        let mut ids: Vec<u32> = found.iter().map(|detection| detection.tag.id).collect();
        ids.sort_unstable();
        assert_eq!(ids, [0, 1, 2, 5, 7, 9], "{family}");
        let mut refiner = Refiner::new(None, &Response::Linear, RefineSettings::default());
        for detection in found {
            let index = spec.ids.iter().position(|id| *id == detection.tag.id).unwrap();
            let refined = refiner.refine(&image, detection.tag, &detection.corners_px).unwrap();
            let truth = corners_px(&sheet, &sheet.board, index);
            for (corner, truth) in refined.observation.corners_px.iter().zip(truth) {
                let off_px = (corner - truth).norm();
                assert!(off_px < 0.05, "{}: {off_px} px off", detection.tag);
            }
        }
    }
}
