//! Materials: which have an exact counterpart, and what comes nearest to the others.
//!
//! | ours | Mitsuba's | |
//! | --- | --- | --- |
//! | dielectric of index 1 (Lambert) | `diffuse` | exact |
//! | rough metal, F0 = 1 | `roughconductor`, material `none` | exact but for the masking |
//! | rough metal, any F0 | `principled`, metallic 1: Schlick's Fresnel too | exact but for the masking |
//! | smooth metal, F0 = 1 | `conductor`, material `none` | exact |
//! | smooth metal, any F0 | the same, reflectance F0 | lacks Schlick's rise at grazing angles |
//! | partly metal, Lambert else | `blendbsdf` | as its parts |
//! | smooth glass | `dielectric` in vacuum; absorption is a `homogeneous` medium | exact |
//! | frosted glass | `roughdielectric` | exact but for the masking |
//! | thin glass | `thindielectric` | that one adds the reflections between both faces |
//! | Lambert under a coat | `principled` | its diffuse part is another |
//!
//! Masking: Mitsuba multiplies Smith's G1 of both directions, we take the height-correlated G2. Their ratio is
//! `1 − Λo Λi/((1 + Λo)(1 + Λi))`: with α ≤ 0.1 it is within 0.1 % of 1 up to 75° off the normal in both directions.

use coshade_scene::{AlphaMode, Material};
use glam::Vec3;

use super::xml::Element;
use crate::bsdf::ggx::SMOOTH_ALPHA;

/// Up to this GGX width both ways of masking agree (see the module).
const SAME_MASKING_ALPHA: f32 = 0.1;

/// A material in Mitsuba's words.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapped {
    /// The surface.
    pub bsdf: Element,
    /// What fills the body, if that absorbs.
    pub interior: Option<Element>,
    /// Emission of the front.
    pub emitter: Option<Element>,
    /// What is not exact about it.
    pub approximations: Vec<&'static str>,
}

/// Translates.
///
/// # Errors
/// What there is no counterpart for, and what to do.
pub fn map(material: &Material) -> Result<Mapped, &'static str> {
    check_constant(material)?;
    let mut mapped =
        Mapped { bsdf: Element::new("bsdf"), interior: None, emitter: None, approximations: Vec::new() };
    let glass = material.transmission * (1.0 - material.metallic);
    if glass > 0.0 && glass < 1.0 {
        return Err("it is partly glass: set transmission to 0 or 1, and metallic to 0");
    }
    mapped.bsdf =
        if glass > 0.0 { map_glass(material, &mut mapped)? } else { map_opaque(material, &mut mapped)? };
    if material.double_sided && glass == 0.0 {
        mapped.bsdf = Element::plugin("bsdf", "twosided").child(mapped.bsdf);
    }
    let radiance = material.emitted_radiance();
    if radiance != Vec3::ZERO {
        if material.double_sided {
            return Err("it shines to both sides: set double_sided = false, or add a second surface");
        }
        mapped.emitter = Some(Element::plugin("emitter", "area").rgb("radiance", radiance));
    }
    Ok(mapped)
}

fn check_constant(material: &Material) -> Result<(), &'static str> {
    let textures = [
        &material.base_color_texture,
        &material.metallic_roughness_texture,
        &material.emissive_texture,
        &material.transmission_texture,
        &material.thickness_texture,
    ];
    if textures.iter().any(|texture| texture.is_some()) {
        return Err("textures are not exported: state base_color, roughness, metallic, … in the session");
    }
    if material.normal_map.is_some() {
        return Err("normal maps are not exported: use a mesh without one");
    }
    if material.alpha_mode != AlphaMode::Opaque {
        return Err("cut-out and transparent alpha are not exported: use an opaque material");
    }
    Ok(())
}

fn map_glass(material: &Material, mapped: &mut Mapped) -> Result<Element, &'static str> {
    if material.ior <= 0.0 {
        return Err("an index of refraction of 0 (reflects everything) is not exported: state ior");
    }
    let thin = material.thickness_m <= 0.0;
    let absorption = material.absorption_per_m();
    if !thin && absorption != Vec3::ZERO {
        if !absorption.is_finite() {
            return Err("it absorbs a colour over no distance at all: give attenuation_color parts above 0");
        }
        let medium = Element::plugin("medium", "homogeneous").attribute("name", "interior");
        mapped.interior = Some(medium.rgb("sigma_t", absorption).rgb("albedo", Vec3::ZERO));
    }
    let rough = material.alpha() >= SMOOTH_ALPHA;
    let kind = match (thin, rough) {
        (true, true) => {
            return Err("frosted thin glass is not exported: set roughness = 0 or give thickness_m");
        }
        (true, false) => {
            mapped.approximations.push("thin glass gets the reflections between its two faces besides");
            "thindielectric"
        }
        (false, true) => {
            note_masking(material, mapped);
            "roughdielectric"
        }
        (false, false) => "dielectric",
    };
    // Mitsuba's own default is the index of air.
    let bsdf = Element::plugin("bsdf", kind)
        .parameter("float", "int_ior", material.ior)
        .parameter("float", "ext_ior", 1.0)
        .rgb("specular_transmittance", material.base_color.truncate());
    Ok(if kind == "roughdielectric" { with_ggx(bsdf, material) } else { bsdf })
}

fn map_opaque(material: &Material, mapped: &mut Mapped) -> Result<Element, &'static str> {
    if material.metallic >= 1.0 {
        return Ok(metal(material, mapped));
    }
    if material.ior <= 0.0 {
        return Err("an index of refraction of 0 (reflects everything) is not exported: state ior");
    }
    let base = material.base_color.truncate();
    if material.dielectric_f0() > 0.0 {
        mapped.approximations.push(
            "its coated diffuse reflection becomes Mitsuba's 'principled', which is another model (ior = 1 is exact)",
        );
        return Ok(Element::plugin("bsdf", "principled")
            .rgb("base_color", base)
            .parameter("float", "metallic", material.metallic)
            .parameter("float", "roughness", material.roughness)
            .parameter("float", "eta", material.ior));
    }
    let lambert = Element::plugin("bsdf", "diffuse").rgb("reflectance", base);
    if material.metallic <= 0.0 {
        return Ok(lambert);
    }
    let blend = Element::plugin("bsdf", "blendbsdf").parameter("float", "weight", material.metallic);
    Ok(blend.child(lambert).child(metal(material, mapped)))
}

fn metal(material: &Material, mapped: &mut Mapped) -> Element {
    let f0 = material.base_color.truncate();
    let rough = material.alpha() >= SMOOTH_ALPHA;
    if rough {
        note_masking(material, mapped);
    }
    if rough && f0 != Vec3::ONE {
        return Element::plugin("bsdf", "principled")
            .rgb("base_color", f0)
            .parameter("float", "metallic", 1.0)
            .parameter("float", "roughness", material.roughness);
    }
    let kind = if rough { "roughconductor" } else { "conductor" };
    let mirror = Element::plugin("bsdf", kind).parameter("string", "material", "none");
    match (rough, f0 == Vec3::ONE) {
        (true, _) => with_ggx(mirror, material),
        (false, true) => mirror,
        (false, false) => {
            mapped
                .approximations
                .push("the smooth metal reflects the same at all angles, without Schlick's rise");
            mirror.rgb("specular_reflectance", f0)
        }
    }
}

fn with_ggx(bsdf: Element, material: &Material) -> Element {
    bsdf.parameter("string", "distribution", "ggx").parameter("float", "alpha", material.alpha())
}

fn note_masking(material: &Material, mapped: &mut Mapped) {
    if material.alpha() > SAME_MASKING_ALPHA {
        mapped.approximations.push(
            "masking and shadowing are taken as independent, which darkens grazing reflections (roughness up to 0.31 is \
             exact to 0.1 %)",
        );
    }
}
