//! Poses from real photographs, against what other sensors and people say.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

use std::collections::BTreeSet;
use std::path::Path;

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_lens::response::Response;
use coshade_testdata::find;
use coshade_tracker::detector::{Detector, DetectorSettings, FindTags};
use coshade_tracker::map::{MapSettings, TagMap, View, map_tags};
use coshade_tracker::refine::{RefineSettings, Refiner};
use coshade_tracker::{Family, Luma, TagId, TagObservation, planar_poses};
use nalgebra::{Point3, Vector2, Vector3};

fn observations(path: &Path, lens: &CameraModel) -> Vec<TagObservation> {
    let picture = image::open(path).unwrap().into_luma8();
    let (width, height) = picture.dimensions();
    let luma = Luma::new(picture.as_raw(), width, height, width).unwrap();
    let found = Detector::new(&DetectorSettings::default()).unwrap().find(&luma).unwrap();
    let mut refiner = Refiner::new(Some(*lens), &Response::Srgb, RefineSettings::default());
    let refined = |tag: &coshade_tracker::Detection| refiner.refine(&luma, tag.tag, &tag.corners_px).ok();
    found.iter().filter_map(refined).map(|refined| refined.observation).collect()
}

/// Depth of a Kinect v2 over a tag's area, in metres, and how many pixels have one.
fn sensor_depth_m(path: &Path, corners_px: &[Vector2<f64>; 4]) -> (f64, usize) {
    let depth = image::open(path).unwrap().into_luma16();
    let inside = |x: u32, y: u32| {
        let at = Vector2::new(f64::from(x), f64::from(y));
        let side = |i: usize| (corners_px[(i + 1) % 4] - corners_px[i]).perp(&(at - corners_px[i]));
        let sides = [0, 1, 2, 3].map(side);
        sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0)
    };
    let codes = depth.enumerate_pixels().filter(|(x, y, code)| code.0[0] > 0 && inside(*x, *y));
    let mut codes: Vec<u16> = codes.map(|(_, _, code)| code.0[0]).collect();
    codes.sort_unstable();
    (codes.get(codes.len() / 2).map_or(f64::NAN, |code| f64::from(*code) * 1e-3), codes.len())
}

/// The sensor's distances are longer than those of the tag by 1 to 3 cm, near and far alike, which is up to 3.3 % of the
/// shortest. Whether sensor, registration or the stated size is off is not known, so an offset that all frames share is
/// taken out by their median; what this test sees is whether distances grow as the sensor's do.
#[test]
fn distances_are_those_of_a_depth_sensor() {
    let Some(folder) = find("distances_are_those_of_a_depth_sensor", "rgbd/apriltags-rgbd-kinect2") else {
        return;
    };
    let k = [529.2945, 531.2834, 466.9604, 273.2594];
    let lens = CameraModel::from_params(ModelKind::Pinhole, &k).unwrap();
    let tag = TagId { family: Family::Tag36h11, id: 0 };
    let mut pairs = Vec::new();
    for frame in ["0001", "0004", "0007", "0010", "0013", "0019"] {
        let seen = observations(&folder.join(format!("rgb_frame{frame}.png")), &lens);
        let own = seen.iter().find(|seen| seen.tag == tag).unwrap_or_else(|| panic!("{frame}: no tag"));
        let [pose, _] = planar_poses(&lens, own, 0.048).unwrap();
        let depth = folder.join(format!("depth_frame{frame}.png"));
        let (sensor_m, pixels) = sensor_depth_m(&depth, &own.corners_px);
        let tag_m = pose.camera_from_tag.translation.z;
        let percent = 100.0 * (tag_m / sensor_m - 1.0);
        eprintln!("{frame}: {tag_m:.4} m, sensor {sensor_m:.4} m of {pixels} pixels: {percent:+.2} %");
        assert!(pixels > 100, "{frame}: {pixels} pixels");
        pairs.push((tag_m, sensor_m));
    }
    let mut offsets: Vec<f64> = pairs.iter().map(|(tag_m, sensor_m)| sensor_m - tag_m).collect();
    offsets.sort_by(f64::total_cmp);
    let offset_m = (offsets[2] + offsets[3]) / 2.0;
    assert!(offset_m.abs() < 0.03, "{offset_m} m");
    for (tag_m, sensor_m) in pairs {
        let error = tag_m / (sensor_m - offset_m) - 1.0;
        assert!(error.abs() < 0.025, "{tag_m} m, sensor {sensor_m} m less {offset_m} m");
    }
}

const SIZE_M: f64 = 0.16;

/// Photographs of a room with tags 0 to 19 on its walls, in walking order, and which of them are in each.
fn room(folder: &Path, lens: &CameraModel) -> (Vec<View>, Vec<BTreeSet<u32>>) {
    let listed = std::fs::read_to_string(folder.join("groundtruth.txt")).unwrap();
    let view = |(number, line): (usize, &str)| {
        let (name, ids) = line.split_once(' ').unwrap();
        let ids = ids.split_whitespace().map(|id| id.parse().unwrap()).collect();
        (View { number: number as u64, observations: observations(&folder.join(name), lens) }, ids)
    };
    listed.lines().enumerate().map(view).unzip()
}

fn mapped(views: &[View], lens: &CameraModel, refine_lens: bool) -> TagMap {
    let settings = MapSettings { size_m: Some(SIZE_M), refine_lens, ..MapSettings::default() };
    let map = map_tags(views, lens, &settings, &|| true).unwrap();
    let closure = map.closure.as_ref().unwrap();
    eprintln!(
        "lens refined: {refine_lens}; rms {:.3} px, {} rejected, loop of {} tags, {:.2} m: off by {:.3} m, {:.2} deg",
        map.rms_px,
        map.rejected.len(),
        closure.tags.len(),
        closure.length_m,
        closure.adjusted.translation_m,
        closure.adjusted.rotation_rad.to_degrees()
    );
    map
}

#[test]
fn photographs_of_a_room_make_one_map() {
    let test = "photographs_of_a_room_make_one_map";
    let Some(folder) = find(test, "handheld-tags/swatbotics-mapping") else { return };
    let lens = CameraModel::from_params(ModelKind::Pinhole, &[765.0, 764.18, 393.72, 304.66]).unwrap();
    let (views, listed) = room(&folder, &lens);
    for (view, listed) in views.iter().zip(&listed) {
        let seen: BTreeSet<u32> = view.observations.iter().map(|seen| seen.tag.id).collect();
        assert_eq!(&seen, listed, "image {}", view.number);
    }
    // The lens of a telephone bends lines by about a pixel, which a pinhole cannot follow.
    for (refine_lens, most_px, most_of_loop) in [(false, 0.5, 0.08), (true, 0.25, 0.02)] {
        let map = mapped(&views, &lens, refine_lens);
        let ids: Vec<u32> = map.tags.iter().map(|tag| tag.tag.id).collect();
        assert_eq!(ids, (0..20).collect::<Vec<_>>());
        assert!(map.unconnected.is_empty() && map.rms_px < most_px, "{} px", map.rms_px);
        assert!(map.views.iter().all(|view| view.tags.len() >= 2), "{:?}", map.rejected);
        let closure = map.closure.as_ref().unwrap();
        assert!(closure.adjusted.translation_m < most_of_loop * closure.length_m, "{closure:?}");
        if refine_lens {
            room_is_a_box(&map);
        }
    }
}

/// All walls stand, and each is across or along that of tag 0: within 5 degrees, more than its standard deviations.
fn room_is_a_box(map: &TagMap) {
    for tag in &map.tags {
        let normal = map.tag(map.origin).unwrap().map_from_tag.inverse() * tag.map_from_tag * Vector3::z();
        let off_deg = normal.amax().min(1.0).acos().to_degrees();
        assert!(off_deg < 5.0 && normal.y.abs() < 0.1, "{}: {normal:?}", tag.tag);
        // Nobody sees a wall from behind: tags face the room's middle.
        let middle = map.tags.iter().map(|tag| tag.map_from_tag.translation.vector).sum::<Vector3<f64>>();
        let middle = Point3::from(middle / map.tags.len() as f64);
        assert!((tag.map_from_tag.inverse() * middle).z > 0.0, "{}", tag.tag);
    }
}
