//! Glowing triangles: surfaces with an emissive material.

use std::f32::consts::PI;

use coshade_scene::World;
use glam::{Vec2, Vec3};

use crate::accel::{Geometry, offset};
use crate::bsdf::{Frame, luminance};
use crate::surface::{SurfaceMaterial, normals};

/// One triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glow {
    /// Number within [`Geometry`].
    pub triangle: u32,
    /// Real or virtual.
    pub world: World,
    normal: Vec3,
    area_m2: f32,
    double_sided: bool,
    mean_radiance: Vec3,
}

/// A point of a glowing triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlowPoint {
    /// World coordinates, offset towards the side that is seen.
    pub position: Vec3,
    /// Normal of that side.
    pub normal: Vec3,
    /// Radiance there.
    pub radiance: Vec3,
}

/// Where a texture is looked at to estimate the power: centres of the 4ᵏ parts of a triangle, k = 2.
const PROBES: u32 = 16;

impl Glow {
    /// Of a triangle; `None` if its material emits nothing.
    pub fn of(geometry: &Geometry, triangle: u32) -> Option<Self> {
        let material = geometry.material(triangle);
        if material.emitted_radiance().max_element() <= 0.0 {
            return None;
        }
        let corners = geometry.corners(triangle);
        let [a, b, c] = corners;
        let mean_radiance = if material.emissive_texture.is_some() {
            // A texture that is dark where it is probed may shine elsewhere: never less than a hundredth.
            let probed = (0..PROBES).map(|probe| {
                let [x, y] = crate::random::sobol_2d(probe, 0).map(crate::random::unit_float);
                SurfaceMaterial::at(geometry, triangle, triangle_point(Vec2::new(x, y))).emitted
            });
            let mean = probed.sum::<Vec3>() / PROBES as f32;
            mean.max(material.emitted_radiance() / 100.0)
        } else {
            material.emitted_radiance()
        };
        Some(Self {
            triangle,
            world: geometry.thing_of(triangle).world,
            normal: normals::geometric(&corners),
            area_m2: (b - a).cross(c - a).length() / 2.0,
            double_sided: material.double_sided,
            mean_radiance,
        })
    }

    /// Luminance of the flux, estimated where textured.
    pub fn power(&self) -> f32 {
        let sides = if self.double_sided { 2.0 } else { 1.0 };
        luminance(self.mean_radiance) * PI * self.area_m2 * sides
    }

    /// Density of points drawn from it, per m².
    pub fn pdf_per_m2(&self) -> f32 {
        1.0 / self.area_m2
    }

    /// True if both sides shine.
    pub fn is_double_sided(&self) -> bool {
        self.double_sided
    }

    /// A point drawn uniformly from the front, or from the back (`side` −1).
    pub fn point(&self, geometry: &Geometry, u2: Vec2, side: f32) -> GlowPoint {
        let corners = geometry.corners(self.triangle);
        let barycentric = offset::away_from_edges(triangle_point(u2), &corners);
        let [a, b, c] = corners;
        let position = a * barycentric.x + b * barycentric.y + c * barycentric.z;
        let normal = self.normal * side;
        GlowPoint {
            position: position + normal * offset::offset_m(position, &corners),
            normal,
            radiance: SurfaceMaterial::at(geometry, self.triangle, barycentric).emitted,
        }
    }

    /// A point drawn uniformly, on the side that is seen from `from`; also its density per steradian there. `None` from
    /// behind a single-sided one.
    pub fn sample(&self, geometry: &Geometry, from: Vec3, u2: Vec2) -> Option<(GlowPoint, f32)> {
        let [corner, ..] = geometry.corners(self.triangle);
        let height = (from - corner).dot(self.normal);
        if height <= 0.0 && !self.double_sided {
            return None;
        }
        let point = self.point(geometry, u2, 1.0_f32.copysign(height));
        let pdf_sr = self.pdf_sr(from, point.position);
        (pdf_sr > 0.0 && point.radiance.max_element() > 0.0).then_some((point, pdf_sr))
    }

    /// Density per steradian at `from` of its point at `position`; 0 from behind a single-sided one.
    pub fn pdf_sr(&self, from: Vec3, position: Vec3) -> f32 {
        let to_viewer = from - position;
        let distance2 = to_viewer.length_squared();
        let cos_angle = to_viewer.dot(self.normal) / distance2.sqrt();
        let cos_angle = if self.double_sided { cos_angle.abs() } else { cos_angle };
        if cos_angle > 0.0 { distance2 / (cos_angle * self.area_m2) } else { 0.0 }
    }

    /// Around the normal of a side, for emitted directions.
    pub fn frame(&self, side: f32) -> Frame {
        Frame::around(self.normal * side)
    }
}

/// Uniform barycentric coordinates (E. Heitz, *A Low-Distortion Map Between Triangle and Square*, 2019).
pub fn triangle_point(u2: Vec2) -> Vec3 {
    let (x, y) = if u2.y > u2.x {
        let x = u2.x / 2.0;
        (x, u2.y - x)
    } else {
        let y = u2.y / 2.0;
        (u2.x - y, y)
    };
    Vec3::new(x, y, 1.0 - x - y)
}
