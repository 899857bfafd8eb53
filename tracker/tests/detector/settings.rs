//! Settings are checked, and do what they say.

use coshade_tracker::Family;
use coshade_tracker::detector::{Detector, DetectorError, DetectorSettings, FindTags};

use crate::synthetic::scene;

fn refused(change: impl Fn(&mut DetectorSettings)) -> String {
    let mut settings = DetectorSettings::default();
    change(&mut settings);
    Detector::new(&settings).expect_err("out of range").to_string()
}

#[test]
fn settings_out_of_range_are_named() {
    for decimate in [0.0, 0.99, 1.2, 2.5, 17.0, -2.0, f32::NAN, f32::INFINITY] {
        let error = refused(|settings| settings.decimate = decimate);
        assert!(
            error.starts_with("decimate = ") && error.ends_with("1, 1.5 or a whole number up to 16"),
            "{error}"
        );
    }
    for threads in [0, 65, u32::MAX] {
        assert!(refused(|settings| settings.threads = threads).starts_with("threads = "));
    }
    for blur in [-8.5, f32::NAN, f32::INFINITY] {
        assert!(refused(|settings| settings.blur_px = blur).starts_with("blur_px = "));
    }
    assert!(refused(|settings| settings.decode_sharpening = f64::NAN).starts_with("decode_sharpening = "));
    assert!(refused(|settings| settings.max_hamming = 3).ends_with("0 to 2"));
    assert!(refused(|settings| settings.min_cluster_pixels = 0).starts_with("min_cluster_pixels = 0"));
    assert!(refused(|settings| settings.min_white_black_diff = Some(256)).ends_with("0 to 255"));
    assert_eq!(refused(|settings| settings.families.clear()), "families: none is given");
    assert_eq!(
        refused(|settings| settings.families.push(Family::Tag36h11)),
        "families: tag36h11 is given twice"
    );
}

#[test]
fn tables_that_would_fill_the_memory_are_refused() {
    for family in [Family::Circle49h12, Family::Standard52h13, Family::Custom48h12] {
        let settings =
            DetectorSettings { families: vec![family], max_hamming: 2, ..DetectorSettings::default() };
        let error = Detector::new(&settings).expect_err("gigabytes");
        assert!(matches!(error, DetectorError::Table { .. }));
        assert!(error.to_string().ends_with("set max_hamming to 1"), "{error}");
        assert!(Detector::new(&DetectorSettings { max_hamming: 1, ..settings }).is_ok());
    }
}

#[test]
fn contrast_and_size_can_be_asked_for() {
    let picture = scene();
    let count = |change: &dyn Fn(&mut DetectorSettings)| {
        let mut settings = DetectorSettings::default();
        change(&mut settings);
        Detector::new(&settings).unwrap().find(&picture.luma()).unwrap().len()
    };
    assert_eq!(count(&|settings| settings.min_white_black_diff = Some(100)), 3);
    // White is 170 codes brighter than black.
    assert_eq!(count(&|settings| settings.min_white_black_diff = Some(210)), 0);
    // Outlines have some 4 pixels per pixel of the side.
    assert_eq!(count(&|settings| settings.min_cluster_pixels = 5000), 0);
    // The smallest tag, of 60 px, would have 4.
    assert!(count(&|settings| settings.decimate = 16.0) < 3);
}

#[test]
fn a_detector_can_change_its_thread() {
    fn moves<T: Send>(_: &T) {}
    let mut detector =
        Detector::new(&DetectorSettings { threads: 2, ..DetectorSettings::default() }).unwrap();
    moves(&detector);
    let picture = scene();
    assert_eq!(detector.find(&picture.luma()).unwrap().len(), 3);
    let there = std::thread::scope(|scope| scope.spawn(|| detector.find(&picture.luma())).join().unwrap());
    assert_eq!(there.unwrap().len(), 3);
}
