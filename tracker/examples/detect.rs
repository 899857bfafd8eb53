//! Finds tags in images and says what that cost, as JSON: `detect [OPTIONS] IMAGE…`.
//!
//! | option | |
//! | --- | --- |
//! | `--families A,B` | families; tag36h11 |
//! | `--decimate N`, `--threads N`, `--blur PX`, `--refine-edges BOOL`, `--sharpening X`, `--max-hamming N`, `--min-cluster N`, `--min-contrast N` | as in `DetectorSettings` |
//! | `--repeat N` | the fastest of so many searches counts; 1 |
//! | `--region SIDE` | also searches a square of this side around each tag |
//! | `--refine` | corners as refined; without `--camera`, as if there were no lens |
//! | `--camera FX,FY,CX,CY` | a pinhole |
//! | `--size-m X` | size of the tags: with `--camera` also both poses of each |
//!
//! The answer is a list with an object per image: `file`, `width_px`, `height_px`, `cpu_ms` of the search alone (of all threads;
//! null where the system does not tell), `refine_cpu_ms`, `pose_cpu_ms`, `tags` (`family`, `id`, `corners_px`, `hamming`,
//! `margin`, `explained` if it could be refined, `camera_from_tag`: both matrices of 3 × 4 numbers, the better first), and with
//! `--region` `region_cpu_ms` per region and `regions_found`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_lens::response::Response;
use coshade_tracker::detector::{Detector, DetectorSettings, FindTags, Region};
use coshade_tracker::refine::{RefineSettings, Refiner};
use coshade_tracker::{Detection, Luma, TagObservation, planar_poses};
use nalgebra::Isometry3;
use serde_json::{Value, json};

struct Options {
    settings: DetectorSettings,
    repeat: u32,
    region_px: Option<u32>,
    refine: bool,
    lens: Option<CameraModel>,
    size_m: Option<f64>,
    images: Vec<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = Options::parse(std::env::args().skip(1))?;
    let mut detector = Detector::new(&options.settings)?;
    let mut refiner =
        options.refine.then(|| Refiner::new(options.lens, &Response::Linear, RefineSettings::default()));
    let reports = options.images.iter().map(|path| {
        report(path, &mut detector, refiner.as_mut(), &options)
            .map_err(|error| format!("{}: {error}", path.display()))
    });
    let reports: Vec<Value> = reports.collect::<Result<_, _>>()?;
    serde_json::to_writer(std::io::stdout().lock(), &reports)?;
    Ok(())
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error>> {
        let mut options = Self {
            settings: DetectorSettings::default(),
            repeat: 1,
            region_px: None,
            refine: false,
            lens: None,
            size_m: None,
            images: Vec::new(),
        };
        while let Some(name) = arguments.next() {
            if !name.starts_with("--") {
                options.images.push(name.into());
                continue;
            }
            if name == "--refine" {
                options.refine = true;
                continue;
            }
            let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
            options.set(&name, &value).map_err(|error| format!("{name} {value}: {error}"))?;
        }
        Ok(options)
    }

    fn set(&mut self, name: &str, value: &str) -> Result<(), Box<dyn Error>> {
        let settings = &mut self.settings;
        match name {
            "--families" => {
                settings.families = value.split(',').map(FromStr::from_str).collect::<Result<_, _>>()?
            }
            "--decimate" => settings.decimate = value.parse()?,
            "--threads" => settings.threads = value.parse()?,
            "--blur" => settings.blur_px = value.parse()?,
            "--refine-edges" => settings.refine_edges = value.parse()?,
            "--sharpening" => settings.decode_sharpening = value.parse()?,
            "--max-hamming" => settings.max_hamming = value.parse()?,
            "--min-cluster" => settings.min_cluster_pixels = value.parse()?,
            "--min-contrast" => settings.min_white_black_diff = Some(value.parse()?),
            "--repeat" => self.repeat = value.parse::<u32>()?.max(1),
            "--camera" => {
                let numbers: Vec<f64> = value.split(',').map(str::parse).collect::<Result<_, _>>()?;
                self.lens = Some(CameraModel::from_params(ModelKind::Pinhole, &numbers)?);
            }
            "--size-m" => self.size_m = Some(value.parse()?),
            "--region" => self.region_px = Some(value.parse()?),
            _ => return Err("no such option".into()),
        }
        Ok(())
    }
}

fn report(
    path: &Path,
    detector: &mut Detector,
    refiner: Option<&mut Refiner>,
    options: &Options,
) -> Result<Value, Box<dyn Error>> {
    let picture = image::open(path)?.into_luma8();
    let (width_px, height_px) = picture.dimensions();
    let luma = Luma::new(picture.as_raw(), width_px, height_px, width_px)?;
    let (mut found, cpu_ms) = fastest(options.repeat, || detector.find(&luma))?;
    let mut report = json!({ "file": path, "width_px": width_px, "height_px": height_px, "cpu_ms": cpu_ms });
    if let Some(side) = options.region_px {
        let regions: Vec<Region> = found.iter().map(|tag| around(tag, side)).collect();
        let (hits, cpu_ms) = fastest(options.repeat, || {
            regions.iter().zip(&found).try_fold(0, |hits, (region, tag)| {
                let again = detector.find_in(&luma, *region, 1)?;
                Ok::<_, Box<dyn Error>>(hits + usize::from(again.iter().any(|other| other.tag == tag.tag)))
            })
        })?;
        report["region_cpu_ms"] = json!(cpu_ms.map(|cpu_ms| cpu_ms / regions.len() as f64));
        report["regions_found"] = json!(hits);
    }
    let mut observations: Vec<TagObservation> =
        found.iter().map(|tag| TagObservation::from_detection(tag, OUTLINE_ERROR_PX)).collect();
    let mut explained = vec![None; found.len()];
    if let Some(refiner) = refiner {
        let (refined, cpu_ms) = fastest(options.repeat, || {
            let refined = found.iter().map(|tag| refiner.refine(&luma, tag.tag, &tag.corners_px).ok());
            Ok::<_, Box<dyn Error>>(refined.collect::<Vec<_>>())
        })?;
        for (index, refined) in refined.into_iter().enumerate() {
            if let Some(refined) = refined {
                found[index].corners_px = refined.observation.corners_px;
                observations[index] = refined.observation;
                explained[index] = Some(refined.explained);
            }
        }
        report["refine_cpu_ms"] = json!(cpu_ms);
    }
    let mut tags: Vec<Value> = found.iter().zip(explained).map(|(tag, part)| tag_json(tag, part)).collect();
    if let Some((lens, size_m)) = options.lens.as_ref().zip(options.size_m) {
        let (poses, cpu_ms) = fastest(options.repeat, || {
            let poses = observations.iter().map(|observation| planar_poses(lens, observation, size_m).ok());
            Ok::<_, Box<dyn Error>>(poses.collect::<Vec<_>>())
        })?;
        for (tag, poses) in tags.iter_mut().zip(poses) {
            tag["camera_from_tag"] =
                json!(poses.map(|poses| poses.map(|pose| matrix(&pose.camera_from_tag))));
        }
        report["pose_cpu_ms"] = json!(cpu_ms);
    }
    report["tags"] = json!(tags);
    Ok(report)
}

/// Standard error of corners that are not refined, in px.
const OUTLINE_ERROR_PX: f64 = 0.3;

fn matrix(pose: &Isometry3<f64>) -> [[f64; 4]; 3] {
    let matrix = pose.to_homogeneous();
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

fn tag_json(found: &Detection, explained: Option<f64>) -> Value {
    let corners_px = found.corners_px.map(|corner| [corner.x, corner.y]);
    json!({
        "family": found.tag.family,
        "id": found.tag.id,
        "corners_px": corners_px,
        "hamming": found.hamming,
        "margin": found.margin,
        "explained": explained,
    })
}

/// A square around a tag, as far as it is in the image.
fn around(found: &Detection, side_px: u32) -> Region {
    let first = |axis: usize| {
        let center = found.corners_px.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0;
        (center - f64::from(side_px) / 2.0).max(0.0) as u32
    };
    Region { x_px: first(0), y_px: first(1), width_px: side_px, height_px: side_px }
}

/// The result of the last run, and the time of the fastest.
fn fastest<T, E>(repeat: u32, mut run: impl FnMut() -> Result<T, E>) -> Result<(T, Option<f64>), E> {
    let mut timed = || {
        let before = cpu_ms();
        let result = run()?;
        Ok((result, cpu_ms().zip(before).map(|(after, before)| after - before)))
    };
    let (mut result, mut best) = timed()?;
    for _ in 1..repeat {
        let (again, time) = timed()?;
        best = best.zip(time).map(|(best, time)| best.min(time));
        result = again;
    }
    Ok((result, best))
}

/// What all threads of this process have computed, from Linux's scheduler. It adds up when a thread pauses, else a few times
/// per 10 ms.
fn cpu_ms() -> Option<f64> {
    std::thread::sleep(Duration::from_micros(1));
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    let nanoseconds = tasks.map(|task| {
        let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    });
    Some(nanoseconds.sum::<Option<f64>>()? * 1e-6)
}
