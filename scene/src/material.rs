//! How surfaces scatter light: Lambert + GGX as in glTF metallic-roughness, with transmission.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use thiserror::Error;

use crate::texture::Texture;

/// How alpha is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// A surface is there where alpha ≥ `cutoff`, and not there elsewhere.
    Mask {
        /// In [0, 1]; glTF's default is 0.5.
        cutoff: f32,
    },
    /// Alpha is coverage.
    Blend,
}

/// Bends normals. The texture's RGB is `(n + 1)/2` in the tangent frame, +Y up (OpenGL's sign).
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// Linear.
    pub texture: Arc<Texture>,
    /// Multiplies x and y before normalising.
    pub scale: f32,
}

/// A glTF 2.0 material: a mix of a dielectric (Lambert or transmission under a GGX coat) and a metal.
///
/// Factors multiply their textures. Colours are linear.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// For messages and for choosing materials by name.
    pub name: String,
    /// Albedo of the dielectric, F0 of the metal (RGB); alpha.
    pub base_color: Vec4,
    /// sRGB; RGB × base_color.rgb, A × base_color.a.
    pub base_color_texture: Option<Arc<Texture>>,
    /// 0 dielectric … 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX's α is its square, see [`Material::alpha`].
    pub roughness: f32,
    /// Linear; G × roughness, B × metallic.
    pub metallic_roughness_texture: Option<Arc<Texture>>,
    /// Bends the shading normal.
    pub normal_map: Option<NormalMap>,
    /// Emitted colour; the radiance is [`Material::emitted_radiance`].
    pub emissive: Vec3,
    /// KHR_materials_emissive_strength.
    pub emissive_strength: f32,
    /// sRGB; × emissive.
    pub emissive_texture: Option<Arc<Texture>>,
    /// KHR_materials_transmission: share of the light entering the dielectric that passes through.
    pub transmission: f32,
    /// Linear; R × transmission.
    pub transmission_texture: Option<Arc<Texture>>,
    /// KHR_materials_ior: index of refraction of the dielectric. glTF's 0 ("always F = 1") is kept as 0.
    pub ior: f32,
    /// KHR_materials_volume: thickness for renderers that do not trace through the body, in the mesh's own unit.
    /// 0: thin-walled, light is not bent and nothing is absorbed.
    pub thickness_m: f32,
    /// Linear; G × thickness.
    pub thickness_texture: Option<Arc<Texture>>,
    /// Colour of white light after [`Material::attenuation_distance_m`] inside; each part in (0, 1].
    pub attenuation_color: Vec3,
    /// Positive, may be infinite (no absorption).
    pub attenuation_distance_m: f32,
    /// How alpha is used.
    pub alpha_mode: AlphaMode,
    /// Also visible from behind, with the normal turned to the viewer.
    pub double_sided: bool,
}

impl Default for Material {
    /// glTF's default material, except that it is a rough dielectric: albedo 0.8, roughness 1, not metallic.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::new(0.8, 0.8, 0.8, 1.0),
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_map: None,
            emissive: Vec3::ZERO,
            emissive_strength: 1.0,
            emissive_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            ior: 1.5,
            thickness_m: 0.0,
            thickness_texture: None,
            attenuation_color: Vec3::ONE,
            attenuation_distance_m: f32::INFINITY,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

impl Material {
    /// A rough dielectric of this albedo.
    pub fn diffuse(albedo: Vec3) -> Self {
        Self { base_color: albedo.extend(1.0), ..Self::default() }
    }

    /// A metal of this normal-incidence reflectance (see [`fresnel_f0`] for η and k) and perceptual roughness.
    pub fn metal(f0: Vec3, roughness: f32) -> Self {
        Self { base_color: f0.extend(1.0), metallic: 1.0, roughness, ..Self::default() }
    }

    /// A smooth clear dielectric body. Refracts as a solid: its mesh must be closed.
    pub fn glass(ior: f32) -> Self {
        Self {
            base_color: Vec4::ONE,
            roughness: 0.0,
            transmission: 1.0,
            ior,
            thickness_m: 1.0,
            ..Self::default()
        }
    }

    /// GGX's α = roughness² (glTF 2.0, appendix B).
    pub fn alpha(&self) -> f32 {
        self.roughness * self.roughness
    }

    /// Normal-incidence reflectance of the dielectric, `((ior − 1)/(ior + 1))²`; 1 for the special value 0.
    pub fn dielectric_f0(&self) -> f32 {
        fresnel_f0(self.ior, 0.0)
    }

    /// Colour times strength, without the texture.
    pub fn emitted_radiance(&self) -> Vec3 {
        self.emissive * self.emissive_strength
    }

    /// Absorption coefficient α′ of Beer–Lambert, `−ln(color)/distance`, per metre of the mesh's unit. Infinite where a
    /// colour part is 0; zero for an infinite distance.
    pub fn absorption_per_m(&self) -> Vec3 {
        if self.attenuation_distance_m.is_infinite() {
            return Vec3::ZERO;
        }
        self.attenuation_color.map(|part| -part.ln() / self.attenuation_distance_m)
    }

    /// Beer–Lambert: share of light left after `distance_m` inside (KHR_materials_volume), `exp(−α′ d)`.
    pub fn transmittance(&self, distance_m: f32) -> Vec3 {
        let exponent = distance_m / self.attenuation_distance_m;
        self.attenuation_color.map(|part| part.powf(exponent))
    }

    /// Whether all numbers are what they may be; textures are not looked at.
    ///
    /// # Errors
    /// [`MaterialError`] names the first that is not.
    pub fn check(&self) -> Result<(), MaterialError> {
        let cutoff = if let AlphaMode::Mask { cutoff } = self.alpha_mode { cutoff } else { 0.5 };
        let [red, green, blue, alpha] = self.base_color.to_array();
        let unit = |value: f32| (0.0..=1.0).contains(&value);
        let positive = |value: f32| value >= 0.0 && value.is_finite();
        let index = |value: f32| value == 0.0 || (value >= 1.0 && value.is_finite());
        let [attenuation_r, attenuation_g, attenuation_b] = self.attenuation_color.to_array();
        let normal_scale = self.normal_map.as_ref().map_or(1.0, |map| map.scale);
        type Rule<'a> = (&'static str, &'a [f32], &'a dyn Fn(f32) -> bool, &'static str);
        let rules: [Rule<'_>; 11] = [
            ("base_color", &[red, green, blue, alpha], &unit, "0 to 1"),
            ("metallic", &[self.metallic], &unit, "0 to 1"),
            ("roughness", &[self.roughness], &unit, "0 to 1"),
            ("emissive", &self.emissive.to_array(), &positive, "0 or more"),
            ("emissive_strength", &[self.emissive_strength], &positive, "0 or more"),
            ("transmission", &[self.transmission], &unit, "0 to 1"),
            ("ior", &[self.ior], &index, "1 or more, or the special value 0"),
            ("thickness_m", &[self.thickness_m], &positive, "0 or more"),
            ("attenuation_color", &[attenuation_r, attenuation_g, attenuation_b], &unit, "0 to 1"),
            ("attenuation_distance_m", &[self.attenuation_distance_m], &|value| value > 0.0, "more than 0"),
            ("alpha cutoff", &[cutoff], &positive, "0 or more"),
        ];
        for (field, values, allowed, expected) in rules {
            if let Some(&value) = values.iter().find(|&&value| !allowed(value)) {
                return Err(MaterialError { material: self.name.clone(), field, value, expected });
            }
        }
        if !normal_scale.is_finite() {
            let (field, value) = ("normal_map.scale", normal_scale);
            return Err(MaterialError {
                material: self.name.clone(),
                field,
                value,
                expected: "a finite number",
            });
        }
        Ok(())
    }

    /// True where light passes into the body and is bent: transmission with a volume.
    pub fn is_refractor(&self) -> bool {
        self.transmission > 0.0 && self.thickness_m > 0.0
    }
}

/// Normal-incidence reflectance `((η − 1)² + k²)/((η + 1)² + k²)` against air. η and k per colour for metals.
pub fn fresnel_f0(eta: f32, k: f32) -> f32 {
    let (minus, plus) = (eta - 1.0, eta + 1.0);
    (minus * minus + k * k) / (plus * plus + k * k)
}

/// Exponent of the Blinn–Phong lobe closest to GGX or Beckmann of width α: `2/α² − 2` (Walter et al. 2007, eq. 30 and
/// following). Infinite for a mirror (α = 0); never below 0 for α ≤ 1.
pub fn phong_exponent(alpha: f32) -> f32 {
    2.0 / (alpha * alpha) - 2.0
}

/// Inverse of [`phong_exponent`]: `α = √(2/(n + 2))`.
pub fn alpha_from_phong(exponent: f32) -> f32 {
    (2.0 / (exponent + 2.0)).sqrt()
}

/// A number of a material that makes no sense.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("material '{material}': {field} = {value}, expected {expected}")]
pub struct MaterialError {
    /// Name of the material.
    pub material: String,
    /// Which number.
    pub field: &'static str,
    /// Its value.
    pub value: f32,
    /// What would be right.
    pub expected: &'static str,
}
