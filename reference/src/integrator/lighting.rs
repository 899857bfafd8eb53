//! Light sampling: one way to one light, in both worlds, weighted against hitting the light by chance.

use glam::Vec2;

use super::eye_path::EyePath;
use super::strand::{Arrival, Purpose, Strand};
use crate::accel::Sees;
use crate::bsdf::{Transport, transmittance};
use crate::differential::Worlds;
use crate::emitter::LightSample;
use crate::random::Sampler;

/// Power heuristic (Veach 1997, §9.2.4, β = 2): weight of a sample drawn with density `own` that the other technique
/// would have drawn with density `other`.
pub fn power_heuristic(own: f32, other: f32) -> f32 {
    if own <= 0.0 {
        return 0.0;
    }
    // By the ratio: densities near delta lobes are too large to be squared.
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

impl EyePath<'_> {
    /// Adds what a light, drawn at random, sends to a vertex and on to the eye.
    pub(super) fn add_light_sample(&mut self, strand: &Strand, arrival: &Arrival, sampler: Sampler) {
        let u_light = strand.sampler(sampler, Purpose::LightChoice).next_2d();
        let u_point = Vec2::new(strand.sampler(sampler, Purpose::LightPoint).next_1d(), u_light.y);
        let geometry = self.scene.accel().geometry();
        let Some(light) = self.scene.lights().sample(geometry, arrival.surface.position, u_light.x, u_point)
        else {
            return;
        };
        let lit = strand.worlds.and(Worlds::of(light.world));
        let scattered = arrival.scattering.eval(arrival.wo, light.wi, Transport::Radiance);
        if lit.is_empty() || scattered.max_element() <= 0.0 || !(light.pdf > 0.0 && light.pdf.is_finite()) {
            return;
        }
        let by_chance = arrival.scattering.pdf(arrival.wo, light.wi);
        let weight = power_heuristic(light.pdf, by_chance) / light.pdf;
        let absorbed = absorption_to_light(strand, arrival, &light);
        let radiance = strand.weight * scattered * light.radiance * absorbed * weight;
        let seed = strand.sampler(sampler, Purpose::Shadow).next_bits();
        let reached = self.reached(lit, arrival, &light, seed);
        self.radiance.add(reached, radiance);
    }

    /// The worlds in which nothing lies between the surface and the light. What blocks in the real world blocks in the
    /// mixed one.
    fn reached(&self, lit: Worlds, arrival: &Arrival, light: &LightSample, seed: u32) -> Worlds {
        let ray = light.shadow_ray(arrival.surface.origin_towards(light.wi), seed);
        let accel = self.scene.accel();
        if lit.in_mixed && !accel.occluded(&ray, Sees::Everything) {
            return lit;
        }
        let only_real = lit.and(Worlds::REAL);
        let hopeless = only_real.is_empty() || (lit.in_mixed && !self.scene.has_virtual());
        if hopeless || accel.occluded(&ray, Sees::RealOnly) { Worlds::NONE } else { only_real }
    }
}

/// Along the straight way from the surface to the light, which must not leave the medium.
fn absorption_to_light(strand: &Strand, arrival: &Arrival, light: &LightSample) -> glam::Vec3 {
    let surface = &arrival.surface;
    let same_side = surface.geometric_normal.dot(light.wi) * surface.geometric_normal.dot(arrival.wo) > 0.0;
    let medium = if same_side || surface.material.thin {
        strand.interior.medium()
    } else if surface.front {
        surface.medium()
    } else {
        strand.interior.around(surface.body)
    };
    let distance_m = light.target.map_or(f32::INFINITY, |target| target.distance(surface.position));
    transmittance(medium.absorption_per_m, distance_m)
}

#[cfg(test)]
mod tests {
    use super::power_heuristic;

    #[test]
    fn weights_of_both_techniques_sum_to_one() {
        for (a, b) in [(1.0, 2.0), (1e-3, 1e30), (5.0, 0.0), (f32::MAX, f32::MAX)] {
            let sum = power_heuristic(a, b) + power_heuristic(b, a);
            assert!((sum - 1.0).abs() < 1e-6, "{a} {b}: {sum}");
        }
        assert_eq!(power_heuristic(0.0, 1.0), 0.0);
        assert_eq!(power_heuristic(2.0, 1.0), 0.8);
    }
}
