//! A material's parameters at a place of a surface.

use std::sync::Arc;

use coshade_scene::texture::Texture;
use glam::{Vec3, Vec4};

use super::texture::lookup;
use crate::accel::Geometry;
use crate::bsdf::Gltf;

/// Factors times textures times vertex colours, in the ranges the models want.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceMaterial {
    /// Albedo of the dielectric, F0 of the metal, tint of the glass; in [0, 1].
    pub base_color: Vec3,
    /// 0 dielectric … 1 metal.
    pub metallic: f32,
    /// GGX width, the square of the roughness; in [0, 1].
    pub alpha: f32,
    /// Share of the dielectric that is glass.
    pub transmission: f32,
    /// Index of refraction; 0 reflects everything.
    pub ior: f32,
    /// Light passes through without being bent, and there is no inside.
    pub thin: bool,
    /// Of the inside, per metre.
    pub absorption_per_m: Vec3,
    /// Radiance of the front.
    pub emitted: Vec3,
    /// The back looks like the front.
    pub double_sided: bool,
}

impl SurfaceMaterial {
    /// At a place of a triangle.
    pub fn at(geometry: &Geometry, triangle: u32, barycentric: Vec3) -> Self {
        let material = geometry.material(triangle);
        let uv = geometry.uv(triangle, barycentric);
        let texel = |texture: &Option<Arc<Texture>>| {
            texture.as_deref().map_or(Vec4::ONE, |texture| lookup(texture, uv))
        };
        let colors = &geometry.thing_of(triangle).mesh.colors;
        let vertex = geometry.interpolate(triangle, barycentric, colors).unwrap_or(Vec4::ONE);
        let base = material.base_color * vertex * texel(&material.base_color_texture);
        let metallic_roughness = texel(&material.metallic_roughness_texture);
        let roughness = (material.roughness * metallic_roughness.y).clamp(0.0, 1.0);
        Self {
            base_color: base.truncate().clamp(Vec3::ZERO, Vec3::ONE),
            metallic: (material.metallic * metallic_roughness.z).clamp(0.0, 1.0),
            alpha: roughness * roughness,
            transmission: (material.transmission * texel(&material.transmission_texture).x).clamp(0.0, 1.0),
            ior: material.ior.max(0.0),
            // A texture thins a body for renderers that do not trace through it; here the mesh says how thick it is.
            thin: material.thickness_m <= 0.0,
            absorption_per_m: material.absorption_per_m(),
            emitted: material.emitted_radiance() * texel(&material.emissive_texture).truncate(),
            double_sided: material.double_sided,
        }
    }

    /// The opaque glTF surface of these parameters, in a medium of index `ior_around`.
    pub fn opaque(&self, ior_around: f32) -> Gltf {
        Gltf {
            base: self.base_color,
            metallic: self.metallic,
            f0: coshade_scene::material::fresnel_f0(self.ior / ior_around, 0.0),
            alpha: self.alpha,
        }
    }
}
