//! Real photographs, of which it is known which tags are in them.

use std::collections::BTreeMap;
use std::path::Path;

use coshade_testdata::find;
use coshade_tracker::detector::{Detector, DetectorSettings, FindTags};
use coshade_tracker::{Detection, Luma};
use nalgebra::Vector2;

fn detections(path: &Path, settings: &DetectorSettings) -> Vec<Detection> {
    let picture = image::open(path).unwrap().into_luma8();
    let (width, height) = picture.dimensions();
    let luma = Luma::new(picture.as_raw(), width, height, width).unwrap();
    Detector::new(settings).unwrap().find(&luma).unwrap()
}

/// File name to ids, from lines such as `NAME (SHAPE) uint8 COUNT [ID, ID] h N`.
fn listed(text: &str) -> BTreeMap<String, Vec<u32>> {
    let entry = |line: &str| {
        let (name, rest) = line.split_once(' ')?;
        let ids = rest.split_once('[')?.1.split_once(']')?.0;
        let mut ids: Vec<u32> = ids.split(',').map(|id| id.trim().parse()).collect::<Result<_, _>>().ok()?;
        ids.sort_unstable();
        Some((name.to_owned(), ids))
    };
    text.lines().filter_map(entry).collect()
}

#[test]
fn every_listed_tag_is_found() {
    let (Some(list), Some(tags)) =
        (find("every_listed_tag_is_found", "TAG_DETECTIONS.txt"), find("every_listed_tag_is_found", "tags"))
    else {
        return;
    };
    let listed = listed(&std::fs::read_to_string(list).unwrap());
    let mut seen = 0;
    for folder in ["apriltag-official", "photonvision-2024", "pupil-duckietown", "swatbotics"] {
        for entry in std::fs::read_dir(tags.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap();
            let Some(ids) = listed.get(name) else { continue };
            let found = detections(&path, &DetectorSettings::default());
            let mut missing = ids.clone();
            for tag in &found {
                if let Some(at) = missing.iter().position(|id| *id == tag.tag.id) {
                    missing.remove(at);
                }
            }
            assert!(missing.is_empty(), "{folder}/{name}: missing {missing:?} of {ids:?}");
            seen += 1;
        }
    }
    assert_eq!(seen, listed.len());
}

/// Lines of `ID, (X Y), (X Y), (X Y), (X Y)`, in the coordinates of AprilTag.
fn corner_list(path: &Path) -> Vec<(u32, [Vector2<f64>; 4])> {
    let text = std::fs::read_to_string(path).unwrap();
    let entry = |line: &str| {
        let (id, corners) = line.split_once(',').unwrap();
        let numbers: Vec<f64> = corners
            .split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
            .filter(|word| !word.is_empty())
            .map(|word| word.parse().unwrap())
            .collect();
        let corner = |i: usize| Vector2::new(numbers[2 * i] - 0.5, numbers[2 * i + 1] - 0.5);
        (id.parse().unwrap(), [0, 1, 2, 3].map(corner))
    };
    text.lines().filter(|line| !line.is_empty()).map(entry).collect()
}

#[test]
fn tags_of_the_librarys_own_pictures_are_in_place() {
    let name = "tags_of_the_librarys_own_pictures_are_in_place";
    let Some(folder) = find(name, "tags/apriltag-official") else { return };
    for (stem, listed, needed) in [("33369213973_9d9bb4cc96_c", 12, 12), ("34085369442_304b6bafd9_c", 25, 24)]
    {
        let expected = corner_list(&folder.join(format!("{stem}.txt")));
        assert_eq!(expected.len(), listed);
        let found = detections(&folder.join(format!("{stem}.jpg")), &DetectorSettings::default());
        let in_place = expected.iter().filter(|(id, corners)| {
            let near = |tag: &Detection| {
                let mut pairs = tag.corners_px.iter().zip(corners);
                tag.tag.id == *id && pairs.all(|(a, b)| (a - b).norm() < 3.0)
            };
            found.iter().any(near)
        });
        let in_place = in_place.count();
        assert!(in_place >= needed, "{stem}: {in_place} of {listed} in place, {} found", found.len());
    }
}
