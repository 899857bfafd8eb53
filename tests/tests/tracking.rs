//! Tracked poses against the truth of the recorded desk.

use coshade_tests::tracking::{BodyTruth, desk};
use coshade_tracker::TrackerSettings;

/// Bars are 1.2 to 1.8 times the figures of `cargo run -p coshade-tests --example tracking`: nothing here is random, but images
/// are decoded and fitted by code that may round otherwise elsewhere.
fn check(bodies: &[BodyTruth], overlay_px: [[f64; 2]; 4]) {
    for (body, bar_px) in bodies.iter().zip(overlay_px) {
        let figures = body.figures();
        assert_eq!(body.frames.len(), 40, "{}", body.name);
        assert_eq!((body.flips(), body.ambiguous()), (0, 0), "{}", body.name);
        let [median, most] = figures.overlay_px;
        assert!(median < bar_px[0] && most < bar_px[1], "{}: {median} px, 95 %: {most} px", body.name);
    }
}

#[test]
fn overlays_of_the_desk_are_right_to_a_tenth_of_a_pixel() {
    let searched = desk(TrackerSettings { regions: false, ..TrackerSettings::default() }).unwrap();
    // Twelve tags; one to three; one; one.
    check(&searched, [[0.006, 0.011], [0.07, 0.18], [0.06, 0.1], [0.06, 0.13]]);
    let followed = desk(TrackerSettings::default()).unwrap();
    check(&followed, [[0.009, 0.02], [0.08, 0.22], [0.1, 0.2], [0.12, 0.27]]);
}
