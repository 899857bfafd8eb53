//! The path tracer as the eye of simulated sensors.

use std::sync::Arc;

use coshade_reference::accel::{Ray, Sees};
use coshade_reference::camera::CameraRay;
use coshade_reference::integrator::{EyePath, Method, Settings, TraceScene};
use coshade_reference::random::Sampler;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{DepthSample, Tracer, View, ViewRay};

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

/// Traces paths through a scene, without photons: caustics of small lamps hardly converge.
pub struct PathTracer {
    scene: Arc<TraceScene>,
    spec: TraceSpec,
    content: String,
}

impl PathTracer {
    /// `content` stands for the scene in [`Tracer::key`].
    pub fn new(scene: TraceScene, spec: TraceSpec, content: String) -> Self {
        Self { scene: Arc::new(scene), spec, content }
    }

    /// What it traces.
    pub fn scene(&self) -> &Arc<TraceScene> {
        &self.scene
    }

    fn settings(&self) -> Settings {
        Settings { max_depth: self.spec.max_depth, method: Method::Paths, ..Settings::default() }
    }

    fn sample(&self, view: &View<'_>, pixel: [u32; 2], sample: u32) -> [f32; 3] {
        let mut sampler = Sampler::new(pixel, sample, 0);
        let place = sampler.next_2d();
        let at = |axis: usize| f64::from(pixel[axis]) + f64::from(place[axis]) - 0.5;
        let Some(ray) = view.ray(at(0), at(1)) else { return [0.0; 3] };
        let path = EyePath::trace(&self.scene, self.settings(), None, &camera_ray(&ray), sampler);
        match view.sees {
            Sees::RealOnly => path.radiance.real(),
            Sees::Everything => path.radiance.mixed(),
        }
        .to_array()
    }
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
        view.each_pixel(|x, y| {
            let mut sum = [0.0_f64; 3];
            for sample in 0..self.spec.samples.max(1) {
                let radiance = self.sample(view, [x, y], sample);
                sum.iter_mut().zip(radiance).for_each(|(sum, part)| *sum += f64::from(part));
            }
            sum.map(|sum| (sum / f64::from(self.spec.samples.max(1))) as f32)
        })
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
        format!("paths {:?} {}", self.spec, self.content)
    }
}
