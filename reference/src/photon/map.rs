//! A hashed grid of photons.

use std::f32::consts::PI;
use std::ops::Range;

use glam::{IVec3, Vec3};

use super::Photon;
use crate::bsdf::Transport;
use crate::differential::{Split, Worlds};
use crate::integrator::strand::{Arrival, Strand};
use crate::random::hash_words;

/// Photons belong to a surface whose normal is at most about 25° off.
const SAME_NORMAL: f32 = 0.9;
/// And that is at most this share of the radius above or below the plane.
const SAME_PLANE: f32 = 0.25;
/// Least cosine by which arriving flux is divided.
const GRAZING: f32 = 1e-3;

/// Photons of one pass, ready to be found around a point.
#[derive(Clone, Debug)]
pub struct PhotonMap {
    radius_m: f32,
    cell_m: f32,
    /// Sorted by the hash of their cell.
    photons: Vec<Photon>,
    /// Theirs, once more: most photons are only found to be too far away, and these fit into a processor's cache.
    positions: Vec<Vec3>,
    /// Where the photons of a hash begin; one more than there are hashes.
    begin: Vec<u32>,
}

impl PhotonMap {
    /// Sorts photons for queries of the given radius.
    pub fn new(photons: &[Photon], radius_m: f32) -> Self {
        // A ball then touches at most two cells along each axis.
        let cell_m = (2.0 * radius_m).max(f32::MIN_POSITIVE);
        let buckets = photons.len().next_power_of_two().max(1);
        let mut keyed: Vec<(u32, &Photon)> =
            photons.iter().map(|photon| (hash(cell_of(photon.position, cell_m), buckets), photon)).collect();
        // Stable: the sum does not depend on anything but the photons' order.
        keyed.sort_by_key(|(hash, _)| *hash);
        let mut begin = vec![0; buckets + 1];
        for (hash, _) in &keyed {
            begin[*hash as usize + 1] += 1;
        }
        for bucket in 0..buckets {
            begin[bucket + 1] += begin[bucket];
        }
        let photons: Vec<Photon> = keyed.into_iter().map(|(_, photon)| *photon).collect();
        let positions = photons.iter().map(|photon| photon.position).collect();
        Self { radius_m, cell_m, photons, positions, begin }
    }

    /// How many photons there are.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Adds the light that photons near a vertex send on to the eye (Jensen 1996): `Σ f_r Φ/(π r²)`, each photon in the
    /// worlds in which both it and the eye path exist. `depth_left` is how many scattering events a photon may bring along.
    pub fn gather(&self, strand: &Strand, arrival: &Arrival, depth_left: u32, radiance: &mut Split) {
        if self.photons.is_empty() {
            return;
        }
        let surface = &arrival.surface;
        let normal = surface.geometric_normal * if surface.front { 1.0 } else { -1.0 };
        let per_area = strand.weight / (PI * self.radius_m * self.radius_m);
        self.visit(surface.position, |photon| {
            let offset = photon.position - surface.position;
            let worlds = strand.worlds.and(photon.worlds);
            let belongs = photon.surface == surface.world
                && photon.scatterings <= depth_left
                && photon.normal.dot(normal) > SAME_NORMAL
                && offset.dot(normal).abs() <= SAME_PLANE * self.radius_m;
            if worlds == Worlds::NONE || !belongs {
                return;
            }
            // Flux per area has the cosine in it already.
            let cosine = photon.wi.dot(photon.normal).abs().max(GRAZING);
            let scattered = arrival.scattering.eval(arrival.wo, photon.wi, Transport::Radiance) / cosine;
            radiance.add(worlds, per_area * scattered * photon.flux);
        });
    }

    /// Calls `take` with every photon within the radius.
    fn visit(&self, point: Vec3, mut take: impl FnMut(&Photon)) {
        let low = cell_of(point - self.radius_m, self.cell_m);
        let high = cell_of(point + self.radius_m, self.cell_m);
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                for z in low.z..=high.z {
                    let cell = IVec3::new(x, y, z);
                    let bucket = self.bucket(cell);
                    let positions = self.positions.get(bucket.clone()).unwrap_or_default();
                    for (index, position) in bucket.zip(positions) {
                        let near = position.distance_squared(point) <= self.radius_m * self.radius_m;
                        // Other cells may share the hash.
                        if near && cell_of(*position, self.cell_m) == cell {
                            self.photons.get(index).into_iter().for_each(&mut take);
                        }
                    }
                }
            }
        }
    }

    fn bucket(&self, cell: IVec3) -> Range<usize> {
        let hash = hash(cell, self.begin.len() - 1) as usize;
        match self.begin.get(hash..hash + 2) {
            Some(&[begin, end]) => begin as usize..end as usize,
            _ => 0..0,
        }
    }
}

fn cell_of(point: Vec3, cell_m: f32) -> IVec3 {
    // Away from the largest whole numbers: neighbours must not overflow.
    (point / cell_m).floor().clamp(Vec3::splat(-1e9), Vec3::splat(1e9)).as_ivec3()
}

/// `buckets` is a power of two.
fn hash(cell: IVec3, buckets: usize) -> u32 {
    hash_words(&[cell.x as u32, cell.y as u32, cell.z as u32]) & (buckets as u32).wrapping_sub(1)
}

#[cfg(test)]
mod tests {
    use coshade_scene::World;

    use super::*;
    use crate::random::{Sampler, unit_float};

    fn photon(index: u32) -> Photon {
        let part = |axis| unit_float(hash_words(&[index, axis])) * 2.0 - 1.0;
        Photon {
            position: Vec3::new(part(0), part(1), part(2)),
            wi: Vec3::Z,
            normal: Vec3::Z,
            flux: Vec3::ONE,
            worlds: Worlds::BOTH,
            surface: World::Real,
            scatterings: 1,
        }
    }

    #[test]
    fn finds_each_photon_within_the_radius_once() {
        let photons: Vec<Photon> = (0..5000).map(photon).collect();
        for (trial, radius_m) in [0.01_f32, 0.1, 0.3, 5.0].into_iter().enumerate() {
            let map = PhotonMap::new(&photons, radius_m);
            assert_eq!(map.len(), photons.len());
            for query in 0..50 {
                let mut sampler = Sampler::of_sequence(query, trial as u32);
                let (xy, z) = (sampler.next_2d(), sampler.next_1d());
                let point = xy.extend(z) * 2.0 - 1.0;
                let near = |photon: &&Photon| photon.position.distance_squared(point) <= radius_m * radius_m;
                let expected = photons.iter().filter(near).count();
                let mut found = Vec::new();
                map.visit(point, |photon| found.push(photon.position.to_array().map(f32::to_bits)));
                assert_eq!(found.len(), expected, "radius {radius_m}");
                found.sort_unstable();
                found.dedup();
                assert_eq!(found.len(), expected);
            }
        }
    }

    #[test]
    fn an_empty_map_has_nothing() {
        let map = PhotonMap::new(&[], 0.1);
        assert!(map.is_empty());
        map.visit(Vec3::ZERO, |_| panic!("there is none"));
    }
}
