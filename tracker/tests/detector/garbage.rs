//! Images that hold no tag, are tiny, huge, or full of what the library's tables have no room for.

use coshade_tracker::detector::{Detector, DetectorError, DetectorSettings, FindTags, Region};
use coshade_tracker::{Family, Luma};

use crate::common::Random;
use crate::synthetic::scene;

fn count(settings: &DetectorSettings, pixels: &[u8], width: u32, height: u32) -> usize {
    let luma = Luma::new(pixels, width, height, width).unwrap();
    Detector::new(settings).unwrap().find(&luma).unwrap().len()
}

fn noise(pixels: usize) -> Vec<u8> {
    let mut random = Random(7);
    (0..pixels).map(|_| random.bits() as u8).collect()
}

#[test]
fn tiny_images_hold_no_tag() {
    let noise = noise(70 * 70);
    for (decimate, blur_px, threads) in
        [(1.0, 0.0, 1), (1.5, -8.0, 1), (2.0, 8.0, 3), (16.0, 0.6, 1), (1.0, 8.0, 64)]
    {
        let settings = DetectorSettings {
            decimate,
            blur_px,
            threads,
            families: vec![Family::Tag36h11, Family::Standard41h12],
            ..DetectorSettings::default()
        };
        let mut detector = Detector::new(&settings).unwrap();
        for width in (1..20).chain([31, 32, 33, 34, 66, 70]) {
            for height in [1, 2, 3, 4, 7, 8, 9, 15, 16, 17, 33, 70] {
                let luma = Luma::new(&noise, width, height, width).unwrap();
                assert_eq!(detector.find(&luma).unwrap(), [], "{width} x {height}, {settings:?}");
            }
        }
    }
}

#[test]
fn blank_and_saturated_images_hold_no_tag() {
    for code in [0, 1, 127, 254, 255] {
        assert_eq!(count(&DetectorSettings::default(), &vec![code; 640 * 480], 640, 480), 0);
    }
    // Half of it saturated, the other half black.
    let halves: Vec<u8> = (0..640 * 480).map(|i| if i % 640 < 320 { 255 } else { 0 }).collect();
    assert_eq!(count(&DetectorSettings::default(), &halves, 640, 480), 0);
}

#[test]
fn tags_are_found_in_8k() {
    let (width, height) = (7680, 4320);
    let mut pixels = vec![90; width * height];
    let tile = scene();
    for (row, line) in tile.pixels.chunks(640).enumerate() {
        let start = (row + 3000) * width + 6000;
        pixels[start..start + 640].copy_from_slice(line);
    }
    assert_eq!(count(&DetectorSettings::default(), &pixels, 7680, 4320), 3);
    assert_eq!(
        count(&DetectorSettings { decimate: 3.0, ..DetectorSettings::default() }, &pixels, 7680, 4320),
        3
    );
}

#[test]
fn images_that_are_too_large_are_refused() {
    let pixels = vec![0; 9000 * 9000];
    let find = |width: u32, height: u32, decimate: f32| {
        let mut detector =
            Detector::new(&DetectorSettings { decimate, ..DetectorSettings::default() }).unwrap();
        detector.find(&Luma::new(&pixels, width, height, width).unwrap())
    };
    for (width, height) in [(16_385, 8), (8, 16_385), (9000, 9000)] {
        let error = find(width, height, 1.0).unwrap_err();
        assert!(matches!(error, DetectorError::Image { .. }), "{error}");
        assert!(error.to_string().starts_with(&format!("an image of {width} x {height} pixels")));
    }
    assert!(find(9000, 9000, 2.0).is_ok());
    assert!(find(16_384, 16, 1.0).is_ok());
}

/// Upright stripes one pixel wide: more pairs of areas in a thread's share of the rows than the library makes room for.
#[test]
fn stripes_do_not_overflow_the_library() {
    let cases =
        [(16_384_u32, 30_u32, 8, false), (8000, 50, 64, false), (16_384, 52, 1, true), (4000, 400, 64, true)];
    for (width, height, threads, broken) in cases {
        let white = |x: u32, y: u32| (x + u32::from(broken && y > height / 2)).is_multiple_of(2);
        let stripes: Vec<u8> =
            (0..width * height).map(|i| if white(i % width, i / width) { 250 } else { 5 }).collect();
        let settings = DetectorSettings { threads, ..DetectorSettings::default() };
        assert_eq!(count(&settings, &stripes, width, height), 0);
    }
}

#[test]
fn noise_holds_no_tag() {
    let pixels = noise(1280 * 720);
    assert_eq!(count(&DetectorSettings::default(), &pixels, 1280, 720), 0);
}

#[test]
fn regions_reach_beyond_the_image() {
    let picture = scene();
    let mut detector = Detector::new(&DetectorSettings::default()).unwrap();
    for region in [
        Region { x_px: 0, y_px: 0, width_px: u32::MAX, height_px: u32::MAX },
        Region { x_px: 0, y_px: 0, width_px: 640, height_px: 480 },
    ] {
        assert_eq!(detector.find_in(&picture.luma(), region, 1).unwrap().len(), 3);
    }
    for (x_px, y_px) in [(639, 479), (640, 480), (u32::MAX, u32::MAX)] {
        let region = Region { x_px, y_px, width_px: u32::MAX, height_px: 0 };
        assert_eq!(detector.find_in(&picture.luma(), region, 1).unwrap(), []);
    }
}

/// Images found again and again: whatever the library keeps would add up to hundreds of megabytes.
#[cfg(target_os = "linux")]
#[test]
fn nothing_leaks() {
    let resident_bytes = || {
        let pages = std::fs::read_to_string("/proc/self/statm").unwrap();
        pages.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * 4096
    };
    let picture = scene();
    let part = picture.luma().crop(60, 20, 300, 440).unwrap();
    let search = |times: u32| {
        for _ in 0..times {
            let mut detector =
                Detector::new(&DetectorSettings { decimate: 2.0, ..DetectorSettings::default() }).unwrap();
            assert_eq!(detector.find(&part).unwrap().len(), 2);
        }
    };
    search(20);
    let before = resident_bytes();
    search(60);
    let kept = resident_bytes().saturating_sub(before);
    // A table of 18 MB, or an image of 90 kB, per search. Other tests run at the same time.
    assert!(kept < 60 * 18_000_000 / 2, "{kept} bytes");
}
