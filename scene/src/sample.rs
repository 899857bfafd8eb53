//! Points spread over surfaces by area.
//!
//! Imperfect shadow maps draw a different subset of one point cloud for each light, so any first n of the N points must
//! be well spread themselves. A point takes two coordinates: the first picks the triangle through the running sum of
//! areas, and what is left of it within that triangle's share places, with the second, the point in the triangle. They
//! come from the additive sequence of low discrepancy in two dimensions (Roberts 2018: inverse powers of the plastic
//! number, x³ = x + 1), shifted at random by the seed (Cranley and Patterson 1976). An additive sequence is as good on
//! every prefix, and on every contiguous run, as on the whole.

use std::ops::Range;

use glam::{DVec3, Vec2, Vec3};
use thiserror::Error;

use crate::mesh::{Mesh, MeshError, triangle_area_m2};
use crate::pose::Similarity;

/// Inverse powers of the plastic number 1.3247179572447460, as 64-bit fractions of 1.
const STEPS: [u64; 2] = [0xC13F_A9A9_02A6_328F, 0x91E1_0DA5_C79E_7B1D];

/// A point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Which of the sampled meshes.
    pub thing: u32,
    /// Number of the triangle in its mesh.
    pub triangle: u32,
    /// Number of the part in its mesh, and so its material.
    pub part: u32,
    /// In the common frame, metres.
    pub position: Vec3,
    /// Unit shading normal in the common frame; the triangle's own where the mesh has none.
    pub normal: Vec3,
    /// Texture coordinate; (0, 0) where the mesh has none.
    pub uv: Vec2,
    /// What the point stands for when all N are used: total area / N, m².
    pub area_m2: f32,
}

/// Why nothing can be sampled.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SampleError {
    /// A mesh is broken.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Nothing has an area.
    #[error("there is no surface to put points on: no triangle has an area")]
    NoArea,
}

/// The surface of one or several placed meshes, ready to be sampled.
#[derive(Clone, Debug)]
pub struct SurfaceSampler<'a> {
    placed: Vec<(&'a Mesh, Similarity)>,
    /// First triangle (counted over all meshes) of each mesh, and the end.
    first: Vec<usize>,
    /// Running sum of areas up to and including each triangle, m².
    running_m2: Vec<f64>,
    /// Start of the sequence.
    shift: [u64; 2],
}

impl<'a> SurfaceSampler<'a> {
    /// Sums up the areas of meshes placed in a common frame (`common_from_mesh`). Triangles that are not finite count
    /// nothing. The same seed gives the same points.
    ///
    /// # Errors
    /// [`SampleError`] if a mesh is broken or nothing has an area.
    pub fn new(
        placed: impl IntoIterator<Item = (&'a Mesh, Similarity)>,
        seed: u64,
    ) -> Result<Self, SampleError> {
        let placed: Vec<_> = placed.into_iter().collect();
        let (mut first, mut running_m2, mut sum) = (vec![0], Vec::new(), 0.0);
        for (mesh, common_from_mesh) in &placed {
            mesh.check()?;
            let scale = f64::from(common_from_mesh.scale);
            for [a, b, c] in mesh.triangle_positions() {
                let area = triangle_area_m2(a, b, c) * scale * scale;
                sum += if area.is_finite() { area } else { 0.0 };
                running_m2.push(sum);
            }
            first.push(running_m2.len());
        }
        if !(sum > 0.0 && sum.is_finite()) {
            return Err(SampleError::NoArea);
        }
        let shift = [0, 1].map(|axis| scrambled(seed.wrapping_mul(2).wrapping_add(axis)));
        Ok(Self { placed, first, running_m2, shift })
    }

    /// Area of everything, m².
    pub fn total_area_m2(&self) -> f64 {
        self.running_m2.last().copied().unwrap_or(0.0)
    }

    /// All `count` points of a cloud, each with its share of the area. Any first n of them are well spread too; their
    /// shares are then `count/n` times as large.
    pub fn points(&self, count: u32) -> impl ExactSizeIterator<Item = SurfacePoint> + '_ {
        self.range(0..count, count)
    }

    /// Points `range` of a cloud of `count`.
    pub fn range(&self, range: Range<u32>, count: u32) -> impl ExactSizeIterator<Item = SurfacePoint> + '_ {
        let area_m2 = (self.total_area_m2() / f64::from(count.max(1))) as f32;
        range.map(move |number| self.point(number, area_m2))
    }

    fn point(&self, number: u32, area_m2: f32) -> SurfacePoint {
        let coordinate = |axis: usize| {
            let fraction = self.shift[axis].wrapping_add(STEPS[axis].wrapping_mul(u64::from(number)));
            (fraction >> 11) as f64 / (1_u64 << 53) as f64
        };
        let wanted = coordinate(0) * self.total_area_m2();
        // The first whose running sum is above: triangles without an area are never met.
        let last = self.running_m2.len() - 1;
        let at = self.running_m2.partition_point(|&sum| sum <= wanted).min(last);
        let below = at.checked_sub(1).map_or(0.0, |before| self.running_m2[before]);
        let left = ((wanted - below) / (self.running_m2[at] - below)).clamp(0.0, 1.0);
        let thing = self.first.partition_point(|&first| first <= at) - 1;
        self.on_triangle(thing, at - self.first[thing], barycentric(left, coordinate(1)), area_m2)
    }

    fn on_triangle(&self, thing: usize, triangle: usize, weights: DVec3, area_m2: f32) -> SurfacePoint {
        let (mesh, common_from_mesh) = self.placed[thing];
        let corners = mesh.triangle(triangle).unwrap_or_default().map(|corner| corner as usize);
        let mixed = |values: &[Vec3]| -> DVec3 {
            let weighted = corners.iter().zip(weights.to_array());
            weighted.filter_map(|(&corner, weight)| Some(values.get(corner)?.as_dvec3() * weight)).sum()
        };
        let uv = corners.iter().zip(weights.to_array());
        let uv = uv.filter_map(|(&corner, weight)| Some(*mesh.uvs.get(corner)? * weight as f32)).sum();
        let [a, b, c] = corners.map(|corner| mesh.positions[corner].as_dvec3());
        let facing = (b - a).cross(c - a).normalize_or(DVec3::Z);
        let normal = mixed(&mesh.normals).normalize_or(facing).as_vec3();
        SurfacePoint {
            thing: thing as u32,
            triangle: triangle as u32,
            part: mesh.part_of(triangle as u32).unwrap_or(0) as u32,
            position: common_from_mesh.transform_point(mixed(&mesh.positions).as_vec3()),
            normal: common_from_mesh.transform_direction(normal),
            uv,
            area_m2,
        }
    }
}

/// Uniform over the triangle from uniform over the square, by folding along the diagonal. (The usual square root has the
/// same density but crowds the grid of a low-discrepancy sequence.)
fn barycentric(s: f64, t: f64) -> DVec3 {
    let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
    DVec3::new(1.0 - s - t, s, t)
}

/// SplitMix64 (Steele, Lea and Flood 2014).
fn scrambled(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests;
