//! The walk from the eye.

use glam::Vec3;

use super::settings::{Method, Settings};
use super::strand::{Arrival, Purpose, Strand};
use super::{TraceScene, lighting::power_heuristic};
use crate::accel::{Hit, Ray};
use crate::bsdf::Transport;
use crate::camera::CameraRay;
use crate::differential::{Split, Worlds};
use crate::photon::PhotonMap;
use crate::random::Sampler;

/// The first surface of the mixed world that a camera ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstHit {
    /// Distance from the camera's centre, metres.
    pub range_m: f32,
    /// Shading normal on the viewer's side, world coordinates.
    pub normal: Vec3,
    /// Base colour.
    pub albedo: Vec3,
    /// True for a virtual thing.
    pub is_virtual: bool,
}

/// One camera sample.
pub struct EyePath<'scene> {
    pub(super) scene: &'scene TraceScene,
    settings: Settings,
    photons: Option<&'scene PhotonMap>,
    /// What was found.
    pub radiance: Split,
    /// What is seen.
    pub first: Option<FirstHit>,
}

/// An eye path's end, and how it came there.
#[derive(Clone, Debug)]
struct Tip {
    strand: Strand,
    /// Density of the last direction; `None` if it was the only possible one (of the camera, of a delta lobe).
    pdf: Option<f32>,
    /// Where that direction was drawn.
    from: Vec3,
    /// A scattering event of finite width lies behind.
    has_diffused: bool,
    /// Lamps up to this distance along the ray have been seen to.
    lamps_seen_to_m: f32,
}

/// Where emitted light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Emitter {
    Lamp,
    Environment,
}

impl<'scene> EyePath<'scene> {
    /// Traces a camera ray. `photons` is what [`Method`] asks for; `None` if there are none.
    pub fn trace(
        scene: &'scene TraceScene,
        settings: Settings,
        photons: Option<&'scene PhotonMap>,
        ray: &CameraRay,
        sampler: Sampler,
    ) -> Self {
        Self::trace_in(Worlds::BOTH, scene, settings, photons, ray, sampler)
    }

    /// As [`EyePath::trace`], but looks into the given worlds only: the same light there, with less work.
    pub fn trace_in(
        worlds: Worlds,
        scene: &'scene TraceScene,
        settings: Settings,
        photons: Option<&'scene PhotonMap>,
        ray: &CameraRay,
        sampler: Sampler,
    ) -> Self {
        let mut path = Self { scene, settings, photons, radiance: Split::default(), first: None };
        let ray = Ray::new(ray.origin, ray.direction, 0);
        path.walk(
            Tip {
                strand: Strand::new(ray, Vec3::ONE, worlds),
                pdf: None,
                from: ray.origin,
                has_diffused: false,
                lamps_seen_to_m: 0.0,
            },
            sampler,
        );
        path
    }

    fn walk(&mut self, mut tip: Tip, sampler: Sampler) {
        loop {
            let strand = &mut tip.strand;
            strand.ray.seed = strand.sampler(sampler, Purpose::Alpha).next_bits();
            let hit = self.scene.accel().closest(&strand.ray, strand.worlds.sees());
            self.add_lamps(&mut tip, hit.map_or(f32::INFINITY, |hit| hit.t));
            let Some(hit) = hit else {
                self.add_environment(&tip);
                return;
            };
            let strand = &mut tip.strand;
            if strand.parts_at(self.scene, &hit) {
                let mut real = tip.clone();
                real.strand.worlds = Worlds::REAL;
                self.walk(real, sampler);
                tip.strand.worlds = Worlds::MIXED;
            }
            let arrival = tip.strand.arrive(self.scene, &hit, self.settings.reflection);
            self.note_first(&tip.strand, &arrival, &hit);
            self.add_glow(&tip, &arrival, &hit);
            if tip.strand.scatterings >= self.settings.max_depth || !self.scatter(&mut tip, &arrival, sampler)
            {
                return;
            }
        }
    }

    /// Adds the light that arrives at a vertex and draws where the path goes on; false if it ends.
    fn scatter(&mut self, tip: &mut Tip, arrival: &Arrival, sampler: Sampler) -> bool {
        let by_photons = self.settings.method == Method::Photons;
        if arrival.has_finite_lobe() {
            self.gather(&tip.strand, arrival);
            if self.settings.classes.lit && !by_photons {
                self.add_light_sample(&tip.strand, arrival, sampler);
            }
        }
        let strand = &mut tip.strand;
        let u_direction = strand.sampler(sampler, Purpose::Direction).next_2d();
        let u_lobe = strand.sampler(sampler, Purpose::Lobe).next_1d();
        let sample = arrival
            .straight_on()
            .or_else(|| arrival.scattering.sample(arrival.wo, u_direction, u_lobe, Transport::Radiance));
        let Some(sample) = sample else {
            return false;
        };
        if by_photons && !sample.is_delta {
            return false;
        }
        let u_roulette = strand.sampler(sampler, Purpose::Roulette).next_1d();
        strand.leave(arrival, &sample);
        tip.pdf = (!sample.is_delta).then_some(sample.pdf);
        tip.from = arrival.surface.position;
        tip.has_diffused |= !sample.is_delta;
        tip.lamps_seen_to_m = 0.0;
        strand.survives_roulette(1.0, u_roulette)
    }

    fn gather(&mut self, strand: &Strand, arrival: &Arrival) {
        if let Some(photons) = self.photons {
            let depth_left = self.settings.max_depth - strand.scatterings - 1;
            photons.gather(strand, arrival, depth_left, &mut self.radiance);
        }
    }

    fn note_first(&mut self, strand: &Strand, arrival: &Arrival, hit: &Hit) {
        if strand.scatterings > 0 || !strand.worlds.in_mixed {
            return;
        }
        let surface = &arrival.surface;
        let side = if surface.front { 1.0 } else { -1.0 };
        self.first = Some(FirstHit {
            range_m: hit.t,
            normal: surface.frame.normal * side,
            albedo: surface.material.base_color,
            is_virtual: !surface.world.is_real(),
        });
    }

    /// Lamps along the ray, up to what it hits; they hide nothing, also not each other.
    fn add_lamps(&mut self, tip: &mut Tip, until_m: f32) {
        let rest = Ray { t_min: tip.lamps_seen_to_m, t_max: until_m, ..tip.strand.ray };
        for lamp in self.scene.lights().lamps_along(rest) {
            let weight = self.emission_weight(tip, Emitter::Lamp, || lamp.pdf);
            let radiance = tip.strand.weight * tip.strand.transmittance(lamp.t) * lamp.radiance * weight;
            self.radiance.add(tip.strand.worlds.and(Worlds::of(lamp.world)), radiance);
        }
        tip.lamps_seen_to_m = until_m;
    }

    fn add_environment(&mut self, tip: &Tip) {
        let direction = tip.strand.ray.direction;
        let radiance = self.scene.lights().environment_radiance(direction);
        if radiance == Vec3::ZERO {
            return;
        }
        let weight = self
            .emission_weight(tip, Emitter::Environment, || self.scene.lights().pdf_of_environment(direction));
        let absorbed = tip.strand.transmittance(f32::INFINITY);
        self.radiance.add(tip.strand.worlds, tip.strand.weight * absorbed * radiance * weight);
    }

    fn add_glow(&mut self, tip: &Tip, arrival: &Arrival, hit: &Hit) {
        let radiance = arrival.surface.emitted_radiance();
        if radiance == Vec3::ZERO {
            return;
        }
        let weight = self.emission_weight(tip, Emitter::Lamp, || {
            self.scene.lights().pdf_of_triangle(hit.triangle, tip.from, arrival.surface.position)
        });
        self.radiance.add(tip.strand.worlds, tip.strand.weight * radiance * weight);
    }

    /// How much of the light met counts here, by the table of classes; the rest is found by the other techniques.
    fn emission_weight(&self, tip: &Tip, emitter: Emitter, light_pdf: impl FnOnce() -> f32) -> f32 {
        let Settings { classes, method, .. } = self.settings;
        let counts = match (tip.pdf, tip.has_diffused, emitter) {
            (Some(_), _, _) => classes.lit,
            (None, false, _) => classes.seen,
            (None, true, Emitter::Environment) => classes.environment_caustics,
            (None, true, Emitter::Lamp) => classes.lamp_caustics && method == Method::Paths,
        };
        match tip.pdf {
            Some(pdf) if counts => power_heuristic(pdf, light_pdf()),
            None if counts => 1.0,
            _ => 0.0,
        }
    }
}
