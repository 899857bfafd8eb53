//! A structured-light depth sensor, such as a Kinect.
//!
//! Errors along the axis grow with the square of the distance and depth comes in steps of disparity (Khoshelham, Elberink,
//! *Accuracy and Resolution of Kinect Depth Data for Indoor Mapping Applications*, Sensors 12(2), 2012, eqs. 8 to 10);
//! grazing surfaces are noisier and edges tremble sideways (Nguyen, Izadi, Lovell, *Modeling Kinect Sensor Noise for
//! Improved 3D Reconstruction and Tracking*, 3DIMPVT 2012, eqs. 1 to 3).

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::random::{Purpose, Random};
use crate::tracer::DepthSample;

/// Errors of a depth sensor. The defaults are a Kinect's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct DepthSpec {
    /// Standard deviation of depth at 1 m, seen straight on; grows with the square of the distance. Higher: noisier.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub sigma_m_at_1m: f64,
    /// Distance between neighbouring depths at 1 m; grows with the square of the distance. 0: no steps.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub step_m_at_1m: f64,
    /// Factor c of the further deviation c/√z · θ²/(π/2 − θ)² of a surface that is turned away by θ. Higher: slanted surfaces
    /// are noisier.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub grazing_m: f64,
    /// Nothing is measured on surfaces turned away by more.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub max_angle_deg: f64,
    /// Standard deviation of the place that a pixel measures.
    #[schemars(range(min = 0.0, max = 16.0))]
    pub lateral_sigma_px: f64,
    /// Nothing is measured on the farther side of a depth edge up to so many pixels from it.
    #[schemars(range(max = 16))]
    pub edge_hole_px: u32,
    /// What counts as an edge: the share by which the depth must change from a pixel to another.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub edge_ratio: f64,
    /// Nearest and farthest depth.
    #[schemars(inner(range(min = 0.0, max = 1000.0)))]
    pub range_m: [f64; 2],
    /// Metres a count.
    #[schemars(range(min = 1e-6, max = 1.0))]
    pub unit_m: f64,
}

impl Default for DepthSpec {
    fn default() -> Self {
        Self {
            sigma_m_at_1m: 0.001_425,
            step_m_at_1m: 0.002_85,
            grazing_m: 0.0001,
            max_angle_deg: 80.0,
            lateral_sigma_px: 0.8,
            edge_hole_px: 1,
            edge_ratio: 0.05,
            range_m: [0.5, 5.0],
            unit_m: 0.001,
        }
    }
}

impl DepthSpec {
    /// Standard deviation of a depth before it falls into steps: z² times that at 1 m, and more where the surface is turned
    /// away by `angle_rad`.
    pub fn sigma_m(&self, z_m: f64, angle_rad: f64) -> f64 {
        let rest = (std::f64::consts::FRAC_PI_2 - angle_rad).max(1e-3);
        let grazing = self.grazing_m / z_m.sqrt() * (angle_rad / rest).powi(2);
        self.sigma_m_at_1m * z_m * z_m + grazing
    }

    /// The depth that the nearest whole step of disparity stands for.
    pub fn stepped_m(&self, z_m: f64) -> f64 {
        if self.step_m_at_1m <= 0.0 {
            return z_m;
        }
        // dz = z² d(1/z): even steps of 1/z are steps of z that grow with z².
        let steps = (1.0 / (z_m * self.step_m_at_1m)).round();
        1.0 / (steps.max(1.0) * self.step_m_at_1m)
    }
}

/// A depth sensor: what is there in, what it measures out.
#[derive(Clone, Debug)]
pub struct DepthSensor {
    spec: DepthSpec,
    size_px: [u32; 2],
    seed: u64,
    sensor: u64,
}

impl DepthSensor {
    /// A sensor of `size_px`; `seed` and `sensor` start its noise (see [`Random::at`]).
    pub fn new(spec: DepthSpec, size_px: [u32; 2], seed: u64, sensor: u64) -> Self {
        Self { spec, size_px, seed, sensor }
    }

    /// Its errors.
    pub fn spec(&self) -> &DepthSpec {
        &self.spec
    }

    /// Counts of [`DepthSpec::unit_m`], row by row; 0 where nothing is measured. The same for the same seed, frame number
    /// and truth, whatever the number of threads.
    pub fn counts(&self, truth: &[DepthSample], frame: u64) -> Vec<u16> {
        let width = self.size_px[0] as usize;
        let holes: Vec<bool> =
            (0..truth.len()).into_par_iter().map(|pixel| self.is_shadowed(truth, pixel)).collect();
        (0..truth.len())
            .into_par_iter()
            .map(|pixel| {
                let mut random = Random::at(self.seed, self.sensor, Purpose::DepthNoise, frame, pixel as u64);
                let [dx, dy] = random.normal_pair().map(|n| (n * self.spec.lateral_sigma_px).round() as i64);
                let place = self.moved(pixel % width, pixel / width, dx, dy);
                match truth.get(place) {
                    Some(sample) if !holes.get(place).copied().unwrap_or(true) => {
                        self.count(sample, &mut random)
                    }
                    _ => 0,
                }
            })
            .collect()
    }

    fn count(&self, sample: &DepthSample, random: &mut Random) -> u16 {
        let z_m = f64::from(sample.z_m);
        let angle_rad = f64::from(sample.cos_incidence.clamp(0.0, 1.0)).acos();
        if !is_measurable(z_m) || angle_rad.to_degrees() > self.spec.max_angle_deg {
            return 0;
        }
        let noisy_m = z_m + self.spec.sigma_m(z_m, angle_rad) * random.normal();
        let [nearest_m, farthest_m] = self.spec.range_m;
        if !is_measurable(noisy_m) || noisy_m < nearest_m || noisy_m > farthest_m {
            return 0;
        }
        let count = (self.spec.stepped_m(noisy_m) / self.spec.unit_m).round();
        if count < f64::from(u16::MAX) { count as u16 } else { 0 }
    }

    fn moved(&self, x: usize, y: usize, dx: i64, dy: i64) -> usize {
        let [width, height] = self.size_px.map(i64::from);
        let x = (x as i64 + dx).clamp(0, width - 1);
        let y = (y as i64 + dy).clamp(0, height - 1);
        (y * width + x) as usize
    }

    /// True on the farther side of a depth edge: the projector or the camera does not see it.
    fn is_shadowed(&self, truth: &[DepthSample], pixel: usize) -> bool {
        let (width, reach) = (self.size_px[0] as usize, i64::from(self.spec.edge_hole_px));
        let Some(own) = truth.get(pixel).filter(|sample| is_measurable(f64::from(sample.z_m))) else {
            return true;
        };
        let edge_m = f64::from(own.z_m) * (1.0 - self.spec.edge_ratio);
        let mut around = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
        around.any(|(dx, dy)| {
            let near = truth
                .get(self.moved(pixel % width, pixel / width, dx, dy))
                .map_or(0.0, |near| f64::from(near.z_m));
            is_measurable(near) && near < edge_m
        })
    }
}

fn is_measurable(z_m: f64) -> bool {
    z_m.is_finite() && z_m > 0.0
}
