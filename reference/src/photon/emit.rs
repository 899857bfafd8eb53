//! Photons from the lights to the surfaces.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::Photon;
use crate::accel::Ray;
use crate::bsdf::Transport;
use crate::differential::Worlds;
use crate::emitter::Lights;
use crate::integrator::strand::{Arrival, Purpose, Strand};
use crate::integrator::{Settings, TraceScene};
use crate::random::{Sampler, hash_words};

/// Photons are traced in groups of this many, for the threads.
const GROUP: u32 = 1024;

/// Which photons are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhotonPaths {
    /// L S⁺ up to the first surface of finite lobe, of lamps: the row `lamp_caustics` in [`crate::integrator`].
    Caustics,
    /// All paths of all lights, also direct ones.
    All,
}

/// Traces `count` photons, those of pass `pass` of a seed. The result depends on nothing else; the threads of the current
/// pool share the work. `None` if `stop` was set meanwhile.
pub fn trace_photons(
    scene: &TraceScene,
    settings: &Settings,
    paths: PhotonPaths,
    count: u32,
    [seed, pass]: [u32; 2],
    stop: &AtomicBool,
) -> Option<Vec<Photon>> {
    let walk = Walk { scene, settings, paths, share: 1.0 / count.max(1) as f32 };
    let sequence = hash_words(&[seed, pass, 0x9407]);
    let groups: Option<Vec<Vec<Photon>>> = (0..count.div_ceil(GROUP))
        .into_par_iter()
        .map(|group| {
            let mut found = Vec::new();
            for index in group * GROUP..(group * GROUP).saturating_add(GROUP).min(count) {
                walk.start(Sampler::of_sequence(index, sequence), &mut found);
            }
            (!stop.load(Ordering::Relaxed)).then_some(found)
        })
        .collect();
    Some(groups?.concat())
}

struct Walk<'scene> {
    scene: &'scene TraceScene,
    settings: &'scene Settings,
    paths: PhotonPaths,
    share: f32,
}

impl Walk<'_> {
    fn lights(&self) -> &Lights {
        match self.paths {
            PhotonPaths::Caustics => self.scene.lamps(),
            PhotonPaths::All => self.scene.lights(),
        }
    }

    fn start(&self, mut sampler: Sampler, found: &mut Vec<Photon>) {
        let (u_light, u_position, u_direction) = (sampler.next_1d(), sampler.next_2d(), sampler.next_2d());
        let geometry = self.scene.accel().geometry();
        let Some(emission) = self.lights().sample_emission(geometry, u_light, u_position, u_direction) else {
            return;
        };
        let ray = Ray::new(emission.origin, emission.direction, 0);
        let flux = emission.flux * self.share;
        if flux.is_finite() && flux.max_element() > 0.0 {
            self.walk(Strand::new(ray, flux, Worlds::of(emission.world)), flux.max_element(), sampler, found);
        }
    }

    fn walk(&self, mut strand: Strand, whole: f32, sampler: Sampler, found: &mut Vec<Photon>) {
        while strand.scatterings < self.settings.max_depth {
            strand.ray.seed = strand.sampler(sampler, Purpose::Alpha).next_bits();
            let Some(hit) = self.scene.accel().closest(&strand.ray, strand.worlds.sees()) else {
                return;
            };
            if strand.parts_at(self.scene, &hit) {
                let real = Strand { worlds: Worlds::REAL, ..strand.clone() };
                self.walk(real, whole, sampler, found);
                strand.worlds = Worlds::MIXED;
            }
            let arrival = strand.arrive(self.scene, &hit, self.settings.reflection);
            let all = self.paths == PhotonPaths::All;
            if arrival.has_finite_lobe() && (all || strand.scatterings > 0) {
                found.extend(photon(&strand, &arrival));
            }
            let u_direction = strand.sampler(sampler, Purpose::Direction).next_2d();
            let u_lobe = strand.sampler(sampler, Purpose::Lobe).next_1d();
            let sample = arrival.straight_on().or_else(|| {
                arrival.scattering.sample(arrival.wo, u_direction, u_lobe, Transport::Importance)
            });
            let Some(sample) = sample.filter(|sample| all || sample.is_delta) else {
                return;
            };
            strand.leave(&arrival, &sample);
            // Flux is not squeezed by refraction.
            strand.squeeze = 1.0;
            let u_roulette = strand.sampler(sampler, Purpose::Roulette).next_1d();
            if !strand.survives_roulette(whole, u_roulette) {
                return;
            }
        }
    }
}

fn photon(strand: &Strand, arrival: &Arrival) -> Option<Photon> {
    let surface = &arrival.surface;
    let flux = strand.weight;
    (flux.is_finite() && flux != Vec3::ZERO).then(|| Photon {
        position: surface.position,
        wi: arrival.wo,
        normal: surface.geometric_normal * if surface.front { 1.0 } else { -1.0 },
        flux,
        worlds: strand.worlds,
        surface: surface.world,
        scatterings: strand.scatterings,
    })
}
