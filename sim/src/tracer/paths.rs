//! The path tracer as the eye of simulated sensors.

use std::ops::Range;
use std::sync::Arc;

use coshade_reference::accel::{Ray, Sees};
use coshade_reference::camera::CameraRay;
use coshade_reference::differential::Worlds;
use coshade_reference::integrator::{EyePath, Settings, TraceScene};
use coshade_reference::photon::PhotonMap;
use coshade_reference::random::{Sampler, hash_words};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::caustics::{self, Caustics};
use super::{DepthSample, Tracer, View, ViewRay};
use crate::pose::Rigid;

/// Rows that are traced together. More: fewer threads at once. Fewer: a photon map is no sooner in the cache than the next one
/// is wanted.
const BAND_ROWS: u32 = 16;

/// How carefully pictures are traced.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct TraceSpec {
    /// Paths a pixel. Higher: less of the tracer's own noise, slower.
    #[schemars(range(min = 1, max = 65536))]
    pub samples: u32,
    /// Most scattering events between light and eye: 1 is direct light alone.
    #[schemars(range(min = 1, max = 64))]
    pub max_depth: u32,
}

impl Default for TraceSpec {
    fn default() -> Self {
        Self { samples: 64, max_depth: 8 }
    }
}

/// Traces paths through a scene; caustics of lamps by photons ([`Caustics`]).
pub struct PathTracer {
    scene: Arc<TraceScene>,
    spec: TraceSpec,
    caustics: Caustics,
    content: String,
}

impl PathTracer {
    /// `content` stands for the scene in [`Tracer::key`].
    pub fn new(scene: TraceScene, spec: TraceSpec, content: String) -> Self {
        let caustics = Caustics::new(&scene, spec.samples.max(1));
        Self { scene: Arc::new(scene), spec, caustics, content }
    }

    /// What it traces.
    pub fn scene(&self) -> &Arc<TraceScene> {
        &self.scene
    }

    fn settings(&self) -> Settings {
        Settings { max_depth: self.spec.max_depth, ..Settings::default() }
    }
}

/// What the samples of a view have in common.
struct Samples<'a> {
    scene: &'a TraceScene,
    settings: Settings,
    maps: &'a [PhotonMap],
    view: &'a View<'a>,
    worlds: Worlds,
    seed: u32,
}

impl Samples<'_> {
    /// Sums of the samples of some rows. All samples of one photon map are taken together: one map fits into a processor's
    /// cache, all of them do not, and what the second bounce needs of it may be anywhere.
    fn band(&self, rows: Range<u32>, count: u32) -> Vec<[f64; 3]> {
        let width = self.view.width_px();
        let pixels = || rows.clone().flat_map(|y| (0..width).map(move |x| [x, y]));
        let mut sums = vec![[0.0; 3]; rows.len() * width as usize];
        let maps = self.maps.len().max(1);
        for first in 0..count.min(maps as u32) {
            for (sum, pixel) in sums.iter_mut().zip(pixels()) {
                for sample in (first..count).step_by(maps) {
                    let radiance = self.radiance(pixel, sample);
                    sum.iter_mut().zip(radiance).for_each(|(sum, part)| *sum += f64::from(part));
                }
            }
        }
        sums
    }

    fn radiance(&self, pixel: [u32; 2], sample: u32) -> [f32; 3] {
        let sampler = Sampler::new(pixel, sample, self.seed);
        let place = sampler.clone().next_2d();
        let at = |axis: usize| f64::from(pixel[axis]) + f64::from(place[axis]) - 0.5;
        let Some(ray) = self.view.ray(at(0), at(1)) else { return [0.0; 3] };
        let photons = caustics::of_sample(self.maps, sample);
        let ray = camera_ray(&ray);
        let path = EyePath::trace_in(self.worlds, self.scene, self.settings, photons, &ray, sampler);
        let radiance = if self.worlds.in_real { path.radiance.real() } else { path.radiance.mixed() };
        radiance.to_array()
    }
}

/// A seed for the pictures from a place: with one seed for all, the noise would stand still before a moving camera, like
/// dirt on the lens.
fn seed_of(pose: &Rigid) -> u32 {
    let numbers = pose.rotation.to_array().into_iter().chain(pose.position_m.to_array());
    let words: Vec<u32> =
        numbers.map(f64::to_bits).flat_map(|bits| [bits as u32, (bits >> 32) as u32]).collect();
    hash_words(&words)
}

fn camera_ray(ray: &ViewRay) -> CameraRay {
    CameraRay {
        origin: ray.origin.as_vec3(),
        direction: ray.direction.as_vec3(),
        depth_per_m: ray.depth_per_m as f32,
    }
}

impl Tracer for PathTracer {
    fn radiance(&self, view: &View<'_>) -> Vec<[f32; 3]> {
        let settings = self.settings();
        let samples = Samples {
            scene: &self.scene,
            settings,
            maps: self.caustics.maps(&self.scene, &settings),
            view,
            worlds: match view.sees {
                Sees::RealOnly => Worlds::REAL,
                Sees::Everything => Worlds::MIXED,
            },
            seed: seed_of(&view.world_from_camera),
        };
        let count = self.spec.samples.max(1);
        let bands = view.rows.clone().into_par_iter().step_by(BAND_ROWS as usize);
        let band = |top: u32| samples.band(top..(top + BAND_ROWS).min(view.rows.end), count);
        bands.flat_map_iter(band).map(|sum| sum.map(|sum| (sum / f64::from(count)) as f32)).collect()
    }

    fn depth(&self, view: &View<'_>) -> Vec<DepthSample> {
        let accel = self.scene.accel();
        view.each_pixel(|x, y| {
            let sample = view.ray(f64::from(x), f64::from(y)).and_then(|view_ray| {
                let ray = Ray::new(view_ray.origin.as_vec3(), view_ray.direction.as_vec3(), 0);
                let hit = accel.closest(&ray, view.sees)?;
                let surface = accel.surface(&ray, &hit);
                let cos_incidence = surface.geometric_normal.dot(ray.direction).abs().min(1.0);
                Some(DepthSample { z_m: hit.t * view_ray.depth_per_m as f32, cos_incidence })
            });
            sample.unwrap_or(DepthSample::NOTHING)
        })
    }

    fn key(&self) -> String {
        // The number changes whenever pictures of the same world would.
        format!("paths and photons 3 {:?} {}", self.spec, self.content)
    }
}
