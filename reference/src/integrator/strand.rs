//! A path on its way, from the eye or from a light, in one of the worlds or in both.

use glam::Vec3;

use super::TraceScene;
use crate::accel::{Hit, Ray};
use crate::bsdf::{Interior, Sample, ScatterKind, Scattering, transmittance};
use crate::differential::Worlds;
use crate::random::Sampler;
use crate::surface::{ReflectionModel, Surface};

/// Roulette begins at this vertex; before, every path goes on.
const ROULETTE_FROM: u32 = 4;
/// Survival is never more likely than this.
const MOST_LIKELY: f32 = 0.95;

/// The random numbers of vertex k begin at pair `FIRST_PAIR + k · PAIRS`, in whichever world it is: both worlds get the
/// same ones.
const FIRST_PAIR: u32 = 4;
const PAIRS: u32 = 8;

/// What the random numbers of a vertex are for, in the order of their pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Alpha along the ray that leads to the vertex.
    Alpha,
    /// Which light, and where on it.
    LightChoice,
    /// Where on one of very many.
    LightPoint,
    /// Alpha along the shadow ray.
    Shadow,
    /// Direction within a lobe.
    Direction,
    /// Which lobe.
    Lobe,
    /// Does the path go on?
    Roulette,
}

/// The end of a path.
#[derive(Clone, Debug)]
pub struct Strand {
    /// Where it goes; unit direction.
    pub ray: Ray,
    /// The bodies around the ray.
    pub interior: Interior,
    /// Eye path: weight of radiance found. Photon: flux.
    pub weight: Vec3,
    /// Where the path exists.
    pub worlds: Worlds,
    /// Scattering events so far.
    pub scatterings: u32,
    /// How radiance has been squeezed by refraction; roulette looks at the weight without it.
    pub squeeze: f32,
}

/// What a strand met.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// The place.
    pub surface: Surface,
    /// How light is scattered there.
    pub scattering: Scattering,
    /// True where another body fills both sides: the path goes straight through.
    pub is_buried: bool,
    /// Unit direction back to where the strand came from.
    pub wo: Vec3,
}

impl Strand {
    /// At its first vertex.
    pub fn new(ray: Ray, weight: Vec3, worlds: Worlds) -> Self {
        Self { ray, interior: Interior::outside(), weight, worlds, scatterings: 0, squeeze: 1.0 }
    }

    /// The random numbers of the vertex that the ray leads to.
    pub fn sampler(&self, mut sampler: Sampler, purpose: Purpose) -> Sampler {
        sampler.jump_to(first_pair(self.scatterings) + purpose as u32);
        sampler
    }

    /// True if this hit parts the path: its mixed half is stopped there, its real half goes straight on.
    pub fn parts_at(&self, scene: &TraceScene, hit: &Hit) -> bool {
        self.worlds == Worlds::BOTH && scene.has_virtual() && !scene.accel().geometry().is_real(hit.triangle)
    }

    /// Share of light left after a distance along the ray.
    pub fn transmittance(&self, distance_m: f32) -> Vec3 {
        transmittance(self.interior.medium().absorption_per_m, distance_m)
    }

    /// Goes to a hit, losing what is absorbed on the way.
    pub fn arrive(&mut self, scene: &TraceScene, hit: &Hit, model: ReflectionModel) -> Arrival {
        self.weight *= self.transmittance(hit.t);
        let surface = scene.accel().surface(&self.ray, hit);
        let bounds_body = surface.material.transmission > 0.0 && !surface.material.thin;
        Arrival {
            scattering: surface.scattering(model, self.interior.around(surface.body)),
            is_buried: bounds_body && !surface.front && self.interior.buries_exit_of(surface.body),
            wo: -self.ray.direction,
            surface,
        }
    }

    /// Goes on from a surface in the direction of a sample.
    pub fn leave(&mut self, arrival: &Arrival, sample: &Sample) {
        let surface = &arrival.surface;
        self.weight *= sample.weight;
        if sample.kind.crosses_boundary() {
            let around = self.interior.around(surface.body).ior;
            let eta =
                if surface.front { surface.material.ior / around } else { around / surface.material.ior };
            if eta.is_finite() && eta > 0.0 {
                self.squeeze *= eta * eta;
            }
            self.interior.cross(surface.body, surface.medium(), surface.front);
        }
        self.ray = Ray::new(surface.origin_towards(sample.wi), sample.wi, 0);
        self.scatterings += 1;
    }

    /// Lets a path of little weight end, and strengthens those that survive. `whole` is the weight of a path that has
    /// lost nothing. False if it ends.
    pub fn survives_roulette(&mut self, whole: f32, random: f32) -> bool {
        if self.scatterings < ROULETTE_FROM {
            return self.weight != Vec3::ZERO;
        }
        let left = self.weight.max_element() * self.squeeze / whole;
        let survival = left.min(MOST_LIKELY);
        // Also ends a weight that is not a number.
        let survives = random < survival;
        if survives {
            self.weight /= survival;
        }
        survives
    }
}

impl Arrival {
    /// True where there is a lobe of finite width.
    pub fn has_finite_lobe(&self) -> bool {
        !self.is_buried && !self.scattering.bsdf.is_delta() && !self.is_black()
    }

    /// Straight through, where the interface is buried.
    pub fn straight_on(&self) -> Option<Sample> {
        self.is_buried.then(|| Sample {
            wi: -self.wo,
            weight: Vec3::ONE,
            pdf: 1.0,
            is_delta: true,
            kind: ScatterKind::Refraction,
        })
    }

    fn is_black(&self) -> bool {
        matches!(self.scattering.bsdf, crate::bsdf::Bsdf::Black)
    }
}

fn first_pair(vertex: u32) -> u32 {
    FIRST_PAIR.wrapping_add(vertex.wrapping_mul(PAIRS))
}
