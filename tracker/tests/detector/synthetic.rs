//! Pictures whose truth is known.

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_tracker::detector::{Detector, DetectorSettings, FindTags, Region};
use coshade_tracker::{Detection, Family, Luma, TagId, tag_bitmap};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};

use crate::common::{Look, Picture, PlacedTag, picture};

pub const SIZE_PX: [u32; 2] = [640, 480];

pub fn lens() -> CameraModel {
    CameraModel::from_params(ModelKind::Pinhole, &[600.0, 600.0, 319.5, 239.5]).unwrap()
}

/// A tag in front of the camera, nearly frontal, turned in its plane.
pub fn tag(family: Family, id: u32, at_m: [f64; 3], roll: f64) -> PlacedTag {
    let facing = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI + 0.25);
    let turned = facing * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll);
    PlacedTag {
        tag: TagId { family, id },
        size_m: 0.1,
        camera_from_tag: Isometry3::from_parts(Translation3::from(Vector3::from(at_m)), turned),
    }
}

/// Three tags of 60 to 100 px, in the order in which they are returned.
pub fn three() -> [PlacedTag; 3] {
    let family = Family::Tag36h11;
    [
        tag(family, 3, [-0.16, -0.1, 0.7], 0.4),
        tag(family, 17, [0.15, 0.05, 0.6], 2.0),
        tag(family, 586, [-0.13, 0.16, 0.95], -1.2),
    ]
}

pub fn scene() -> Picture {
    picture(&lens(), SIZE_PX, &three(), &Look::default())
}

/// The largest distance of a corner from where it is, after the order of tags is checked.
fn worst_px(found: &[Detection], truth: &[PlacedTag]) -> f64 {
    let ids = |tags: &mut dyn Iterator<Item = TagId>| tags.collect::<Vec<_>>();
    assert_eq!(ids(&mut found.iter().map(|tag| tag.tag)), ids(&mut truth.iter().map(|tag| tag.tag)));
    let distances = found.iter().zip(truth).flat_map(|(found, truth)| {
        found
            .corners_px
            .iter()
            .zip(truth.corners_px(&lens()))
            .map(|(a, b)| (a - b).norm())
            .collect::<Vec<_>>()
    });
    distances.fold(0.0, f64::max)
}

/// Mean offset of all corners: a half pixel turned twice or never is half a pixel in x and y.
fn bias_px(found: &[Detection], truth: &[PlacedTag]) -> Vector2<f64> {
    let pairs = found.iter().zip(truth);
    let offsets: Vec<Vector2<f64>> = pairs
        .flat_map(|(found, truth)| {
            let truth = truth.corners_px(&lens());
            [0, 1, 2, 3].map(|corner| found.corners_px[corner] - truth[corner])
        })
        .collect();
    offsets.iter().sum::<Vector2<f64>>() / offsets.len() as f64
}

fn found(settings: &DetectorSettings, image: &Luma) -> Vec<Detection> {
    Detector::new(settings).unwrap().find(image).unwrap()
}

#[test]
fn corners_are_where_they_are_at_every_decimation() {
    let picture = scene();
    for decimate in [1.0, 1.5, 2.0, 3.0, 4.0] {
        let settings = DetectorSettings { decimate, ..DetectorSettings::default() };
        let found = found(&settings, &picture.luma());
        let (worst, bias) = (worst_px(&found, &three()), bias_px(&found, &three()));
        // Edges refined in the whole image: a tenth of a pixel of noise and blur; the bias is a mean of 12 corners.
        assert!(worst < 0.5 && bias.amax() < 0.1, "{decimate}: worst {worst}, bias {bias:?}");
    }
}

#[test]
fn corners_without_refined_edges_carry_no_offset() {
    let picture = scene();
    for decimate in [1.0, 1.5, 2.0, 3.0, 4.0] {
        let settings = DetectorSettings { decimate, refine_edges: false, ..DetectorSettings::default() };
        let found = found(&settings, &picture.luma());
        let bias = bias_px(&found, &three());
        // Without the correction it is half a pixel per step of decimation.
        assert!(worst_px(&found, &three()) < 0.6 * f64::from(decimate) + 0.2, "{decimate}");
        assert!(bias.amax() < 0.12 * f64::from(decimate), "{decimate}: {bias:?}");
    }
}

#[test]
fn corners_of_every_family_start_at_the_lower_left() {
    for family in Family::ALL {
        for (id, roll) in [(0, 0.0), (family.tag_count() - 1, 1.9)] {
            let placed = [tag(family, id, [0.02, -0.01, 0.5], roll)];
            let picture = picture(&lens(), SIZE_PX, &placed, &Look::default());
            let settings =
                DetectorSettings { families: vec![family], max_hamming: 1, ..DetectorSettings::default() };
            let found = found(&settings, &picture.luma());
            let right: Vec<Detection> = found.into_iter().filter(|found| found.tag.id == id).collect();
            let worst = worst_px(&right, &placed);
            assert!(worst < 0.6, "{family} {id}: {worst}");
        }
    }
}

#[test]
fn families_are_found_beside_each_other() {
    let placed = [
        tag(Family::Tag25h9, 7, [-0.16, -0.1, 0.7], 0.4),
        tag(Family::Tag36h11, 17, [0.15, 0.05, 0.6], 2.0),
        tag(Family::Standard41h12, 99, [-0.13, 0.15, 0.8], -1.2),
    ];
    let picture = picture(&lens(), SIZE_PX, &placed, &Look::default());
    let families = placed.iter().map(|tag| tag.tag.family).collect();
    let settings = DetectorSettings { families, ..DetectorSettings::default() };
    assert!(worst_px(&found(&settings, &picture.luma()), &placed) < 0.5);
}

#[test]
fn a_tag_that_is_there_twice_is_found_twice() {
    let family = Family::Tag36h11;
    let placed = [tag(family, 5, [-0.15, 0.0, 0.7], 0.1), tag(family, 5, [0.15, 0.0, 0.7], 0.9)];
    let picture = picture(&lens(), SIZE_PX, &placed, &Look::default());
    assert!(worst_px(&found(&DetectorSettings::default(), &picture.luma()), &placed) < 0.5);
}

#[test]
fn several_threads_find_the_same() {
    let picture = scene();
    let one = found(&DetectorSettings::default(), &picture.luma());
    for threads in [2, 5, 64] {
        let settings = DetectorSettings { threads, ..DetectorSettings::default() };
        let mut detector = Detector::new(&settings).unwrap();
        for _ in 0..3 {
            assert_eq!(detector.find(&picture.luma()).unwrap(), one, "{threads}");
        }
    }
}

#[test]
fn parts_of_an_image_give_the_coordinates_of_the_whole() {
    let picture = scene();
    let mut detector = Detector::new(&DetectorSettings::default()).unwrap();
    let all = detector.find(&picture.luma()).unwrap();
    for tag in &all {
        let center = tag.corners_px.iter().sum::<Vector2<f64>>() / 4.0;
        let (x_px, y_px) = (center.x as u32 - 75, center.y as u32 - 75);
        let part = Region { x_px, y_px, width_px: 150, height_px: 150 };
        let found = detector.find_in(&picture.luma(), part, 1).unwrap();
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].tag, tag.tag);
        // The threshold's tiles of four pixels begin elsewhere; the refined edges are the same.
        let distances = found[0].corners_px.iter().zip(tag.corners_px).map(|(a, b)| (a - b).norm());
        assert!(distances.fold(0.0, f64::max) < 0.1);
    }
    let outside = Region { x_px: 640, y_px: 0, width_px: 10, height_px: 10 };
    assert_eq!(detector.find_in(&picture.luma(), outside, 1).unwrap(), []);
}

#[test]
fn rows_with_padding_are_the_same_image() {
    let picture = scene();
    let [width, height] = SIZE_PX.map(|side| side as usize);
    let all = found(&DetectorSettings::default(), &picture.luma());
    for stride in [width + 1, 2 * width, 2 * width + 1] {
        // Padding is white and the last row has none: what is read of it would change the result or crash.
        let mut padded = vec![255; (height - 1) * stride + width];
        for (row, line) in picture.pixels.chunks(width).enumerate() {
            padded[row * stride..row * stride + width].copy_from_slice(line);
        }
        let luma = Luma::new(&padded, SIZE_PX[0], SIZE_PX[1], stride as u32).unwrap();
        assert_eq!(found(&DetectorSettings::default(), &luma), all, "{stride}");
    }
}

#[test]
fn tags_of_low_contrast_are_found_in_parts_of_an_image() {
    let look = Look { black: 100.0, white: 130.0, background: 120.0, noise: 1.0, ..Look::default() };
    let placed = [tag(Family::Tag36h11, 17, [0.0, 0.0, 1.2], 0.3)];
    let picture = picture(&lens(), SIZE_PX, &placed, &look);
    let mut detector = Detector::new(&DetectorSettings::default()).unwrap();
    let part = Region { x_px: 280, y_px: 200, width_px: 80, height_px: 80 };
    assert!(worst_px(&detector.find_in(&picture.luma(), part, 1).unwrap(), &placed) < 1.0);
}

#[test]
fn the_image_is_only_read() {
    let picture = scene();
    let before = picture.pixels.clone();
    for (blur_px, decimate) in [(0.0, 1.0), (0.8, 1.0), (-1.2, 1.0), (0.8, 2.0)] {
        let settings = DetectorSettings { blur_px, decimate, ..DetectorSettings::default() };
        assert_eq!(found(&settings, &picture.luma()).len(), 3, "{blur_px}");
        assert_eq!(picture.pixels, before);
    }
}

/// The cells of a tag as an image, each of so many pixels.
#[test]
fn a_tag_that_fills_the_image_is_found() {
    let bitmap = tag_bitmap(Family::Tag36h11, 42).unwrap();
    let side = bitmap.cells * 12;
    let pixels: Vec<u8> = (0..side * side)
        .map(|i| if bitmap.is_white(i % side / 12, i / side / 12) { 220 } else { 20 })
        .collect();
    let image = Luma::new(&pixels, side, side, side).unwrap();
    let all = found(&DetectorSettings::default(), &image);
    assert_eq!(all.iter().map(|found| found.tag.id).collect::<Vec<_>>(), [42]);
    // Closer still, the border is out of view.
    let part = image.crop(30, 30, side - 60, side - 60).unwrap();
    assert_eq!(found(&DetectorSettings::default(), &part), []);
}
