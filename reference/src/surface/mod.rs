//! From a hit to all that shading needs: place, normals, material.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`texture`] | bilinear look-ups in linear space |
//! | [`material`] | a material's parameters at a place |
//! | [`normals`] | the shading frame: interpolated and mapped normals, kept where they make sense |

pub mod material;
pub mod normals;
mod srgb_table;
pub mod texture;

use coshade_scene::World;
use glam::{Vec2, Vec3};

use crate::accel::{Geometry, Hit, Ray, offset};
use crate::bsdf::ggx::SMOOTH_ALPHA;
use crate::bsdf::mix::Glass;
use crate::bsdf::{
    BodyId, Bsdf, Dielectric, Frame, Gltf, Lambert, Medium, Mix, Phong, RoughDielectric, Scattering,
};
pub use material::SurfaceMaterial;

/// Which reflection model opaque surfaces get.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReflectionModel {
    /// glTF's: Lambert and GGX.
    #[default]
    Ggx,
    /// Normalised modified Phong, for comparison with the papers.
    Phong,
}

/// A place on a surface, seen by a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// World coordinates; on the triangle, a hair's breadth away from its edges (see [`offset`]).
    pub position: Vec3,
    /// Unit normal of the triangle, on its front side.
    pub geometric_normal: Vec3,
    /// Around the shading normal, on the front side.
    pub frame: Frame,
    /// True if the ray came from the front: for a closed body, from outside.
    pub front: bool,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Material parameters at this place.
    pub material: SurfaceMaterial,
    /// Real or virtual.
    pub world: World,
    /// Number of the triangle within [`Geometry`].
    pub triangle: u32,
    /// The body whose boundary this is.
    pub body: BodyId,
    /// Part of the thing's mesh.
    pub part: u32,
    /// How far off the surface rays start, metres.
    pub offset_m: f32,
}

impl Surface {
    /// At a hit of a ray.
    pub fn at(geometry: &Geometry, ray: &Ray, hit: &Hit) -> Self {
        let corners = geometry.corners(hit.triangle);
        let barycentric = offset::away_from_edges(hit.barycentric, &corners);
        let [a, b, c] = corners;
        let position = a * barycentric.x + b * barycentric.y + c * barycentric.z;
        let geometric_normal = normals::geometric(&corners);
        let front = ray.direction.dot(geometric_normal) < 0.0;
        let to_viewer = (-ray.direction).normalize_or(geometric_normal);
        let place = geometry.triangle(hit.triangle);
        Self {
            position,
            geometric_normal,
            frame: normals::shading_frame(geometry, hit.triangle, barycentric, geometric_normal, to_viewer),
            front,
            uv: geometry.uv(hit.triangle, barycentric),
            material: SurfaceMaterial::at(geometry, hit.triangle, barycentric),
            world: geometry.thing_of(hit.triangle).world,
            triangle: hit.triangle,
            body: BodyId { thing: place.thing, material: place.material },
            part: place.part,
            offset_m: offset::offset_m(position, &corners),
        }
    }

    /// Where a ray that leaves in `direction` starts: on that side of the surface.
    pub fn origin_towards(&self, direction: Vec3) -> Vec3 {
        let side = self.geometric_normal.dot(direction);
        self.position + self.geometric_normal * self.offset_m.copysign(side)
    }

    /// Radiance emitted towards the ray's origin; the back of a single-sided surface emits nothing.
    pub fn emitted_radiance(&self) -> Vec3 {
        if self.front || self.material.double_sided { self.material.emitted } else { Vec3::ZERO }
    }

    /// What fills the body, for [`crate::bsdf::Interior::cross`].
    pub fn medium(&self) -> Medium {
        Medium { ior: self.material.ior, absorption_per_m: self.material.absorption_per_m }
    }

    /// How light is scattered here. `around` is what lies on the outer side, [`crate::bsdf::Interior::around`].
    ///
    /// Glass scatters on both sides, and so do double-sided surfaces. The back of a single-sided opaque surface absorbs
    /// all light: it is hit (a desk without underside still shades), but never lit.
    pub fn scattering(&self, model: ReflectionModel, around: Medium) -> Scattering {
        let material = &self.material;
        let glass_share = material.transmission * (1.0 - material.metallic);
        if glass_share > 0.0 {
            return Scattering {
                bsdf: self.glassy_bsdf(glass_share, around),
                frame: self.frame,
                geometric_normal: self.geometric_normal,
            };
        }
        if !self.front && !material.double_sided {
            return Scattering {
                bsdf: Bsdf::Black,
                frame: self.frame,
                geometric_normal: self.geometric_normal,
            };
        }
        let opaque = material.opaque(1.0);
        let bsdf = match model {
            ReflectionModel::Ggx if opaque.metallic == 0.0 && opaque.f0 == 0.0 => {
                Bsdf::Lambert(Lambert { albedo: opaque.base })
            }
            ReflectionModel::Ggx => Bsdf::Gltf(opaque),
            ReflectionModel::Phong => Bsdf::Phong(Phong::from_gltf(&opaque)),
        };
        let side = if self.front { 1.0 } else { -1.0 };
        Scattering { bsdf, frame: self.frame.facing(side), geometric_normal: self.geometric_normal * side }
    }

    fn glassy_bsdf(&self, share: f32, around: Medium) -> Bsdf {
        let material = &self.material;
        let eta = material.ior / around.ior;
        let glass = if material.alpha < SMOOTH_ALPHA || eta <= 0.0 {
            Glass::Smooth(Dielectric { eta, tint: material.base_color, thin: material.thin })
        } else {
            Glass::Rough(RoughDielectric {
                eta,
                tint: material.base_color,
                alpha: material.alpha,
                thin: material.thin,
            })
        };
        match glass {
            Glass::Smooth(glass) if share >= 1.0 => Bsdf::Dielectric(glass),
            Glass::Rough(glass) if share >= 1.0 => Bsdf::RoughDielectric(glass),
            glass => Bsdf::Mix(Mix {
                share,
                opaque: Gltf {
                    // What is left once the glass is taken out: metal and the untransmitting part of the dielectric.
                    metallic: material.metallic / (1.0 - share),
                    ..material.opaque(around.ior)
                },
                glass,
            }),
        }
    }
}

#[cfg(test)]
mod tests;
