//! One pixel: sums while it is rendered, means when it is done.

use glam::{DVec3, Vec3};

use crate::differential::Split;
use crate::integrator::FirstHit;

/// Sum and sum of squares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Moments {
    sum: DVec3,
    squares: DVec3,
}

/// What a pixel's samples add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSums {
    samples: u32,
    hits: u32,
    virtual_hits: u32,
    real: Moments,
    mixed: Moments,
    difference: Moments,
    depth_m: f64,
    normal: DVec3,
    albedo: DVec3,
}

/// A pixel of a [`super::Film`]; see there for the meaning of its fields.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmPixel {
    /// How many samples it has; with none, all else is 0.
    pub samples: u32,
    /// L_r.
    pub real: Vec3,
    /// L_rv.
    pub mixed: Vec3,
    /// L_rv − L_r.
    pub difference: Vec3,
    /// Variance of the mean difference.
    pub variance: Vec3,
    /// Variance of the mean of `real`.
    pub variance_real: Vec3,
    /// Variance of the mean of `mixed`.
    pub variance_mixed: Vec3,
    /// z or range, metres; 0 for nothing.
    pub depth_m: f32,
    /// World coordinates.
    pub normal: Vec3,
    /// Base colour.
    pub albedo: Vec3,
    /// Share of virtual samples.
    pub coverage: f32,
}

impl Moments {
    fn add(&mut self, value: Vec3) {
        let value = value.as_dvec3();
        self.sum += value;
        self.squares += value * value;
    }

    fn mean(&self, samples: u32) -> Vec3 {
        (self.sum / f64::from(samples)).as_vec3()
    }

    /// Of the mean: `(Σx² − (Σx)²/n) / (n (n − 1))`.
    fn variance_of_mean(&self, samples: u32) -> Vec3 {
        if samples < 2 {
            return Vec3::INFINITY;
        }
        let n = f64::from(samples);
        let spread = (self.squares - self.sum * self.sum / n).max(DVec3::ZERO);
        (spread / (n * (n - 1.0))).as_vec3()
    }
}

impl PixelSums {
    /// Adds a sample that sees nothing: the lens has no ray there.
    pub fn add_nothing(&mut self) {
        self.samples += 1;
    }

    /// Adds a sample. False if its radiance is not finite: it then counts as not taken.
    #[must_use]
    pub fn add(&mut self, radiance: &Split, first: Option<&FirstHit>, depth_per_m: f32) -> bool {
        if !radiance.is_finite() {
            return false;
        }
        self.samples += 1;
        self.real.add(radiance.real());
        self.mixed.add(radiance.mixed());
        self.difference.add(radiance.difference());
        if let Some(first) = first {
            self.hits += 1;
            self.virtual_hits += u32::from(first.is_virtual);
            self.depth_m += f64::from(first.range_m * depth_per_m);
            self.normal += first.normal.as_dvec3();
            self.albedo += first.albedo.as_dvec3();
        }
        true
    }

    /// The means so far.
    pub fn finish(&self) -> FilmPixel {
        let samples = self.samples;
        if samples == 0 {
            return FilmPixel::default();
        }
        let n = f64::from(samples);
        FilmPixel {
            samples,
            real: self.real.mean(samples),
            mixed: self.mixed.mean(samples),
            difference: self.difference.mean(samples),
            variance: self.difference.variance_of_mean(samples),
            variance_real: self.real.variance_of_mean(samples),
            variance_mixed: self.mixed.variance_of_mean(samples),
            depth_m: if self.hits == 0 { 0.0 } else { (self.depth_m / f64::from(self.hits)) as f32 },
            normal: (self.normal / n).as_vec3(),
            albedo: (self.albedo / n).as_vec3(),
            coverage: (f64::from(self.virtual_hits) / n) as f32,
        }
    }
}
