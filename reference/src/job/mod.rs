//! Rendering a whole picture: in passes over all pixels, on all processors, until it is good enough.
//!
//! A pass takes one sample of every pixel and traces one photon map. So the samples are spread evenly over the picture
//! whenever it is stopped, and the film's variances contain the photons' noise: every sample of a pixel has seen photons
//! of its own.
//!
//! The same scene, camera and options make the same picture to the last bit, whatever the number of threads: every
//! number drawn depends on seed, pixel and sample alone, and sums are added in the order of the samples. A shard renders
//! its share of the tiles; [`crate::film::merge`] puts shards together.
//!
//! ```no_run
//! # use std::sync::atomic::AtomicBool;
//! # use coshade_image_file::Precision;
//! # use coshade_reference::{camera::Camera, integrator::TraceScene};
//! # use coshade_reference::job::{JobOptions, render};
//! # fn run(scene: &TraceScene, camera: &Camera) -> Result<(), Box<dyn std::error::Error>> {
//! let options = JobOptions { samples: 256, error_limit: Some(0.02), ..JobOptions::default() };
//! let stop = AtomicBool::new(false);
//! let film = render(scene, camera, &options, |progress| println!("{} samples", progress.samples), &stop)?;
//! film.write("truth.exr", Precision::Float)?;
//! # Ok(())
//! # }
//! ```

mod key;
mod options;
mod tiles;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rayon::prelude::*;
use thiserror::Error;

pub use options::{JobOptions, Shard, ShardError};

use crate::camera::Camera;
use crate::film::{Film, FilmFigures, ShardMark};
use crate::integrator::{Classes, Method, TraceScene};
use crate::photon::{PhotonMap, PhotonPaths, RadiusSchedule, trace_photons};
use tiles::{PassView, Tile};

/// With an error limit, no picture is judged by fewer samples.
const FEWEST_SAMPLES: u32 = 16;
/// Without photons a pass takes more samples while the picture is small, for the threads: about this many in all.
const PASS_SAMPLES: u64 = 1 << 14;

/// Why there is no picture.
#[derive(Debug, Error)]
pub enum JobError {
    /// An option that makes no sense.
    #[error("{option} = {value}, expected {expected}")]
    Option {
        /// Its name.
        option: &'static str,
        /// Its value.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// Stopped before anything was there.
    #[error("stopped before the first sample was taken")]
    NoSamples,
    /// The operating system gives no threads.
    #[error("cannot start {threads} threads: {error}")]
    Threads {
        /// How many were wanted, 0 for all processors.
        threads: usize,
        /// Why not.
        error: rayon::ThreadPoolBuildError,
    },
}

/// How far a job is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples that every pixel has.
    pub samples: u32,
    /// Samples that were asked for.
    pub samples_wanted: u32,
    /// Since the start.
    pub elapsed: Duration,
    /// [`FilmFigures::relative_error`] when it was last looked at; only with an error limit.
    pub relative_error: Option<f64>,
}

/// Renders until the samples are taken, the time is over, the error is small enough, or `stop` is set; what is done by
/// then is the picture. After `stop`, tiles may differ by a pass; those without any sample are black and have 0 in the
/// film's `samples`.
///
/// # Errors
/// [`JobError`]: options that make no sense, no threads, or nothing done before `stop`.
pub fn render(
    scene: &TraceScene,
    camera: &Camera,
    options: &JobOptions,
    mut progress: impl FnMut(&Progress),
    stop: &AtomicBool,
) -> Result<Film, JobError> {
    options.check()?;
    let threads = options.threads;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|index| format!("reference-{index}"))
        .build()
        .map_err(|error| JobError::Threads { threads, error })?;
    #[expect(clippy::disallowed_methods, reason = "limits computing time, nothing is replayed")]
    let start = std::time::Instant::now();
    let mut job = Job::new(scene, camera, options);
    let mut relative_error = None;
    while job.samples < options.samples {
        if !pool.install(|| job.pass(stop)) {
            break;
        }
        if options.error_limit.is_some() && job.judges_now() {
            relative_error = Some(job.figures().relative_error());
        }
        let elapsed = start.elapsed();
        progress(&Progress {
            samples: job.samples,
            samples_wanted: options.samples,
            elapsed,
            relative_error,
        });
        let good =
            matches!((relative_error, options.error_limit), (Some(error), Some(limit)) if error <= limit);
        if good || options.time_limit.is_some_and(|limit| elapsed >= limit) {
            break;
        }
    }
    job.finish()
}

struct Job<'a> {
    scene: &'a TraceScene,
    camera: &'a Camera,
    options: &'a JobOptions,
    tiles: Vec<Tile>,
    radius: RadiusSchedule,
    samples: u32,
}

impl<'a> Job<'a> {
    fn new(scene: &'a TraceScene, camera: &'a Camera, options: &'a JobOptions) -> Self {
        let radius_m = options.photon_radius_m.unwrap_or(scene.radius_m() * JobOptions::RADIUS_SHARE);
        Self {
            scene,
            camera,
            options,
            tiles: tiles::of_shard(camera.size_px(), options.shard),
            radius: RadiusSchedule::new(radius_m),
            samples: 0,
        }
    }

    /// One more sample of every pixel (some more without photons). False if it was stopped on the way.
    fn pass(&mut self, stop: &AtomicBool) -> bool {
        let paths = self.photon_paths();
        let photons = match paths {
            Some(paths) => match self.photon_map(paths, stop) {
                Some(map) => Some(map),
                None => return false,
            },
            None => None,
        };
        let [width, height] = self.camera.size_px().map(u64::from);
        let most = if paths.is_some() { 1 } else { (PASS_SAMPLES / (width * height)).clamp(1, 256) as u32 };
        let end = self.samples.saturating_add(most).min(self.options.samples);
        let view = PassView {
            scene: self.scene,
            camera: self.camera,
            settings: self.options.settings,
            seed: self.options.seed,
            photons: photons.as_ref(),
            samples: self.samples..end,
        };
        self.tiles.par_iter_mut().for_each(|tile| {
            if !stop.load(Ordering::Relaxed) {
                tile.render(&view);
            }
        });
        let whole = !stop.load(Ordering::Relaxed);
        if whole {
            self.samples = end;
        }
        whole
    }

    /// Which photons this job needs, if any.
    fn photon_paths(&self) -> Option<PhotonPaths> {
        let settings = &self.options.settings;
        match settings.method {
            Method::Paths => None,
            Method::PathsAndPhotons => {
                let wanted = settings.classes.lamp_caustics && self.scene.may_have_lamp_caustics();
                wanted.then_some(PhotonPaths::Caustics)
            }
            Method::Photons => (settings.classes != Classes { seen: true, ..Classes::NONE }
                && !self.scene.lights().is_empty())
            .then_some(PhotonPaths::All),
        }
    }

    fn photon_map(&self, paths: PhotonPaths, stop: &AtomicBool) -> Option<PhotonMap> {
        let count = self.options.photons_per_pass.unwrap_or_else(|| {
            let [width, height] = self.camera.size_px();
            JobOptions::default_photons(width, height)
        });
        let from = [self.options.seed, self.samples];
        let photons = trace_photons(self.scene, &self.options.settings, paths, count, from, stop)?;
        Some(PhotonMap::new(&photons, self.radius.radius_m(self.samples)))
    }

    /// At powers of two, and at every 64 samples.
    fn judges_now(&self) -> bool {
        let samples = self.samples;
        samples >= FEWEST_SAMPLES && (samples.is_power_of_two() || samples.is_multiple_of(64))
    }

    fn figures(&self) -> FilmFigures {
        let pixels: Vec<_> = self.tiles.iter().flat_map(Tile::finish).map(|(_, pixel)| pixel).collect();
        FilmFigures::of(pixels.iter())
    }

    fn finish(self) -> Result<Film, JobError> {
        let size_px = self.camera.size_px();
        let [width, height] = size_px.map(|side| side as usize);
        let mut pixels = vec![crate::film::FilmPixel::default(); width * height];
        for ([x, y], pixel) in self.tiles.iter().flat_map(Tile::finish) {
            pixels[y as usize * width + x as usize] = pixel;
        }
        let rejected_samples = self.tiles.iter().map(Tile::rejected_samples).sum();
        if rejected_samples == 0 && !self.tiles.is_empty() && pixels.iter().all(|pixel| pixel.samples == 0) {
            return Err(JobError::NoSamples);
        }
        let Shard { index, count } = self.options.shard;
        let key = || key::of_job(self.scene, self.camera, self.options);
        let shard = (count > 1).then(|| ShardMark { index, count, key: key() });
        Ok(Film { size_px, depth_is_range: self.camera.depth_is_range(), pixels, shard, rejected_samples })
    }
}
