//! Materials and their textures.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use ::gltf::Document;
use ::gltf::json::{self, Value};
use ::gltf::material::AlphaMode as GltfAlphaMode;
use ::gltf::texture::{self, MagFilter, MinFilter, WrappingMode};
use glam::{Vec2, Vec3, Vec4};

use super::super::assemble::Assembly;
use super::super::picture;
use super::Fault;
use super::buffers::{Buffers, read_uri};
use crate::material::{AlphaMode, Material, NormalMap};
use crate::texture::{ColorSpace, Filter, Image, Texture, UvTransform, Wrap};

/// Materials so far; each is made when it is first used.
pub(super) struct Materials<'a> {
    buffers: &'a Buffers<'a>,
    folder: &'a Path,
    sources: &'a [json::Image],
    images: HashMap<usize, Arc<Image>>,
    slots: HashMap<(Option<usize>, u32), Slot>,
    pub warnings: Vec<String>,
}

/// Where a material is and which texture coordinates it looks up.
#[derive(Clone, Copy)]
pub(super) struct Slot {
    pub slot: usize,
    pub uv_set: u32,
}

impl<'a> Materials<'a> {
    pub fn new(document: &'a Document, buffers: &'a Buffers<'a>, folder: &'a Path) -> Self {
        let sources = &document.as_json().images;
        Self { buffers, folder, sources, images: HashMap::new(), slots: HashMap::new(), warnings: Vec::new() }
    }

    /// Number of pictures decoded.
    pub fn image_count(&self) -> usize {
        self.images.len()
    }

    /// The slot of a material on a node of this scale: a volume's thickness scales with the node, so each scale
    /// makes a material of its own.
    pub fn slot(
        &mut self,
        material: &::gltf::Material<'_>,
        scale: f32,
        assembly: &mut Assembly,
    ) -> Result<Slot, Fault> {
        let thick = material.volume().is_some_and(|volume| volume.thickness_factor() > 0.0);
        let scale = if thick { scale } else { 1.0 };
        let key = (material.index(), scale.to_bits());
        if let Some(slot) = self.slots.get(&key) {
            return Ok(*slot);
        }
        let mut sets = UvSets::default();
        let converted = self.convert(material, scale, &mut sets)?;
        if sets.mixed {
            let place = place_of(material);
            self.warnings.push(format!(
                "{place}: its textures use several sets of texture coordinates, all are looked up with TEXCOORD_{}",
                sets.set()
            ));
        }
        let slot = Slot { slot: assembly.material(converted), uv_set: sets.set() };
        self.slots.insert(key, slot);
        Ok(slot)
    }

    fn convert(
        &mut self,
        material: &::gltf::Material<'_>,
        scale: f32,
        sets: &mut UvSets,
    ) -> Result<Material, Fault> {
        let place = place_of(material);
        let pbr = material.pbr_metallic_roughness();
        let mut texture = |info: Option<texture::Info<'_>>, space, sets: &mut UvSets| match info {
            None => Ok(None),
            Some(info) => self.texture(&info.texture(), Mapping::of(&info), space, sets).map(Some),
        };
        let transmission = material.transmission();
        let volume = material.volume();
        let mut made = Material {
            name: material.name().unwrap_or_default().to_owned(),
            base_color: Vec4::from_array(pbr.base_color_factor()),
            base_color_texture: texture(pbr.base_color_texture(), ColorSpace::Srgb, sets)?,
            metallic: pbr.metallic_factor(),
            roughness: pbr.roughness_factor(),
            metallic_roughness_texture: texture(pbr.metallic_roughness_texture(), ColorSpace::Linear, sets)?,
            normal_map: None,
            emissive: Vec3::from_array(material.emissive_factor()),
            emissive_strength: material.emissive_strength().unwrap_or(1.0),
            emissive_texture: texture(material.emissive_texture(), ColorSpace::Srgb, sets)?,
            transmission: transmission.as_ref().map_or(0.0, |it| it.transmission_factor()),
            transmission_texture: texture(
                transmission.and_then(|it| it.transmission_texture()),
                ColorSpace::Linear,
                sets,
            )?,
            ior: material.ior().unwrap_or(1.5),
            thickness_m: scale * volume.as_ref().map_or(0.0, |it| it.thickness_factor()),
            thickness_texture: texture(
                volume.as_ref().and_then(|it| it.thickness_texture()),
                ColorSpace::Linear,
                sets,
            )?,
            attenuation_color: volume
                .as_ref()
                .map_or(Vec3::ONE, |it| Vec3::from_array(it.attenuation_color())),
            attenuation_distance_m: volume.as_ref().map_or(f32::INFINITY, |it| it.attenuation_distance()),
            alpha_mode: match material.alpha_mode() {
                GltfAlphaMode::Opaque => AlphaMode::Opaque,
                GltfAlphaMode::Mask => AlphaMode::Mask { cutoff: material.alpha_cutoff().unwrap_or(0.5) },
                GltfAlphaMode::Blend => AlphaMode::Blend,
            },
            double_sided: material.double_sided(),
        };
        if let Some(normal) = material.normal_texture() {
            let mapping = Mapping::of_normal(&normal);
            let texture = self.texture(&normal.texture(), mapping, ColorSpace::Linear, sets)?;
            made.normal_map = Some(NormalMap { texture, scale: normal.scale() });
        }
        made.check().map_err(|problem| Fault::new(place, problem.to_string()))?;
        Ok(made)
    }

    fn texture(
        &mut self,
        texture: &texture::Texture<'_>,
        mapping: Mapping,
        color_space: ColorSpace,
        sets: &mut UvSets,
    ) -> Result<Arc<Texture>, Fault> {
        sets.add(mapping.uv_set);
        let place = format!("textures[{}]", texture.index());
        let image = self.image(texture.source(), &place)?;
        let sampler = texture.sampler();
        let made = Texture {
            image,
            color_space,
            wrap_u: wrap(sampler.wrap_s()),
            wrap_v: wrap(sampler.wrap_t()),
            magnify: match sampler.mag_filter() {
                Some(MagFilter::Nearest) => Filter::Nearest,
                Some(MagFilter::Linear) | None => Filter::Linear,
            },
            minify: match sampler.min_filter() {
                Some(
                    MinFilter::Nearest | MinFilter::NearestMipmapNearest | MinFilter::NearestMipmapLinear,
                ) => Filter::Nearest,
                _ => Filter::Linear,
            },
            uv_transform: mapping.transform,
        };
        let transform = &made.uv_transform;
        if !(transform.offset.is_finite()
            && transform.scale.is_finite()
            && transform.rotation_rad.is_finite())
        {
            return Err(Fault::new(place, "its KHR_texture_transform is not finite"));
        }
        Ok(Arc::new(made))
    }

    fn image(&mut self, image: ::gltf::Image<'_>, texture_place: &str) -> Result<Arc<Image>, Fault> {
        let number = image.index();
        if let Some(image) = self.images.get(&number) {
            return Ok(image.clone());
        }
        let place = format!("images[{number}]");
        let name = image.name().map_or_else(|| place.clone(), str::to_owned);
        // The crate's `source()` panics where both or a picture's type are missing.
        let source = self.sources.get(number);
        let view = source.and_then(|source| source.buffer_view);
        let uri = source.and_then(|source| source.uri.as_ref());
        let bytes: Cow<'_, [u8]> = match (view, uri) {
            (Some(view), _) => self.buffers.view(view.value())?.0.into(),
            (None, Some(uri)) => read_uri(uri, self.folder, &place)?.into(),
            (None, None) => {
                return Err(Fault::new(place, format!("no uri and no bufferView, used by {texture_place}")));
            }
        };
        let (decoded, note) = picture::decode(&bytes, &name, &place)?;
        self.warnings.extend(note);
        let decoded = Arc::new(decoded);
        self.images.insert(number, decoded.clone());
        Ok(decoded)
    }
}

fn place_of(material: &::gltf::Material<'_>) -> String {
    match (material.index(), material.name()) {
        (Some(index), Some(name)) => format!("materials[{index}] '{name}'"),
        (Some(index), None) => format!("materials[{index}]"),
        (None, _) => "default material".to_owned(),
    }
}

fn wrap(mode: WrappingMode) -> Wrap {
    match mode {
        WrappingMode::ClampToEdge => Wrap::ClampToEdge,
        WrappingMode::MirroredRepeat => Wrap::MirroredRepeat,
        WrappingMode::Repeat => Wrap::Repeat,
    }
}

/// Sets of texture coordinates a material asks for. A mesh has one; the base colour is asked first.
#[derive(Default)]
struct UvSets {
    first: Option<u32>,
    mixed: bool,
}

impl UvSets {
    fn add(&mut self, set: u32) {
        self.mixed |= *self.first.get_or_insert(set) != set;
    }

    fn set(&self) -> u32 {
        self.first.unwrap_or(0)
    }
}

/// How a texture is laid onto the surface.
struct Mapping {
    uv_set: u32,
    transform: UvTransform,
}

impl Mapping {
    fn of(info: &texture::Info<'_>) -> Self {
        let Some(it) = info.texture_transform() else {
            return Self { uv_set: info.tex_coord(), transform: UvTransform::default() };
        };
        let transform = UvTransform {
            offset: Vec2::from_array(it.offset()),
            rotation_rad: it.rotation(),
            scale: Vec2::from_array(it.scale()),
        };
        Self { uv_set: it.tex_coord().unwrap_or(info.tex_coord()), transform }
    }

    /// The crate does not read KHR_texture_transform of normal textures.
    fn of_normal(normal: &::gltf::material::NormalTexture<'_>) -> Self {
        let Some(it) = normal.extension_value("KHR_texture_transform") else {
            return Self { uv_set: normal.tex_coord(), transform: UvTransform::default() };
        };
        let number = |value: &Value| value.as_f64().map(|number| number as f32);
        let pair = |key: &str| {
            let pair = it.get(key)?.as_array()?;
            Some(Vec2::new(number(pair.first()?)?, number(pair.get(1)?)?))
        };
        let transform = UvTransform {
            offset: pair("offset").unwrap_or(Vec2::ZERO),
            rotation_rad: it.get("rotation").and_then(number).unwrap_or(0.0),
            scale: pair("scale").unwrap_or(Vec2::ONE),
        };
        let uv_set = it.get("texCoord").and_then(Value::as_u64).and_then(|set| u32::try_from(set).ok());
        Self { uv_set: uv_set.unwrap_or(normal.tex_coord()), transform }
    }
}
