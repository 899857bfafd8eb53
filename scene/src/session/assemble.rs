//! From a session to a scene: reads meshes, makes shapes, applies materials.

use std::path::Path;
use std::sync::Arc;

use coshade_config::{KeyPath, Problem};
use glam::{Vec3, Vec4};

use super::Session;
use super::convert::{vec2, vec3};
use super::light::{LightKindSpec, LightSpec};
use super::thing::{Form, MaterialSpec, MeshUp, RingSpec, ShapeKind, ShapeSpec, ThingSpec};
use crate::import::{ImportError, ImportOptions, Imported, Up, import_with};
use crate::light::{Light, LightKind, Rectangle, Spot};
use crate::material::{Material, alpha_from_phong, fresnel_f0};
use crate::shape::{DEFAULT_SEGMENTS, RingSize, Shape, ShapeError};
use crate::thing::{Scene, Thing};

/// Segments along each edge of the teapot's 32 patches, unless the session says otherwise.
const TEAPOT_SEGMENTS: u32 = 16;

/// A scene, and what a renderer should know beside it.
#[derive(Clone, Debug)]
pub struct Assembled {
    /// Things and lights in the order of the file.
    pub scene: Scene,
    /// Indices of lights whose strength is to be measured; it is 1 for the time being.
    pub lights_to_fit: Vec<usize>,
    /// What importers left out or guessed, each at the key of its thing.
    pub warnings: Vec<Problem>,
}

/// Why a session makes no scene: each problem at its key.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}", .problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n\n"))]
pub struct AssembleError {
    /// In the order of the file.
    pub problems: Vec<Problem>,
}

/// Why one thing cannot be made.
#[derive(Debug, thiserror::Error)]
enum ThingError {
    #[error(transparent)]
    Import(#[from] ImportError),
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

impl Session {
    /// Reads all meshes and makes the scene. All problems are reported together.
    ///
    /// # Errors
    /// [`AssembleError`] with a problem for each thing or light that cannot be made.
    pub fn assemble(&self) -> Result<Assembled, AssembleError> {
        let mut assembly = Assembly { session: self, problems: Vec::new(), warnings: Vec::new() };
        let spec = self.spec();
        let at = |list: &str, index| KeyPath::root().key(list).index(index);
        let things = spec.things.iter().enumerate();
        let things: Vec<Thing> =
            things.filter_map(|(i, thing)| assembly.thing(thing, &at("thing", i))).collect();
        let lights = spec.lights.iter().enumerate();
        let lights: Vec<Light> =
            lights.filter_map(|(i, light)| assembly.light(light, i, &at("light", i))).collect();
        if !assembly.problems.is_empty() {
            return Err(AssembleError { problems: assembly.problems });
        }
        let lights_to_fit =
            spec.lights.iter().enumerate().filter(|(_, light)| light.fit).map(|(i, _)| i).collect();
        Ok(Assembled { scene: Scene { things, lights }, lights_to_fit, warnings: assembly.warnings })
    }
}

struct Assembly<'a> {
    session: &'a Session,
    problems: Vec<Problem>,
    warnings: Vec<Problem>,
}

impl Assembly<'_> {
    /// The value, or a problem at its key.
    fn noted<V, E: ToString>(&mut self, result: Result<V, E>, at: &KeyPath) -> Option<V> {
        let error = |error: E| self.problems.push(self.session.document.error_at(at, error.to_string(), ""));
        result.map_err(error).ok()
    }

    fn thing(&mut self, spec: &ThingSpec, at: &KeyPath) -> Option<Thing> {
        let pose = self.noted(self.session.pose(&spec.pose), &at.key("pose"));
        let (made, key) = match &spec.form {
            Form::Mesh(path) => (self.mesh(spec, path), "mesh"),
            Form::Shape(shape) => (self.shape(shape), "shape"),
        };
        let (mesh, mut materials, warnings) = self.noted(made, &at.key(key))?;
        for warning in warnings {
            self.warnings.push(self.session.document.error_at(at.key(key), warning, "").warning());
        }
        if let Some(change) = &spec.material {
            materials = materials.iter().map(|material| Arc::new(change.applied_to(material))).collect();
        }
        for material in &materials {
            self.noted(material.check(), &at.key("material"))?;
        }
        let (name, world, hide_marker) = (spec.name.clone(), spec.world, spec.hide_marker);
        Some(Thing { name, world, mesh, materials, pose: pose?, hide_marker })
    }

    fn mesh(&self, spec: &ThingSpec, path: &Path) -> Result<Made, ThingError> {
        let defaults = ImportOptions::default();
        let options = ImportOptions {
            up: match spec.mesh_up {
                None => defaults.up,
                Some(MeshUp::Z) => Up::Z,
                Some(MeshUp::Y) => Up::Y,
            },
            unit_m: spec.mesh_unit_m.map_or(defaults.unit_m, |unit_m| unit_m as f32),
            ..defaults
        };
        let Imported { mesh, materials, warnings, .. } = import_with(self.session.resolve(path), &options)?;
        Ok((mesh, materials, warnings))
    }

    fn shape(&self, spec: &ShapeSpec) -> Result<Made, ThingError> {
        let mesh = spec.shape().mesh()?;
        let materials = mesh.parts.iter().map(|part| part.material + 1).max().unwrap_or(1);
        let material = Arc::new(Material::default());
        Ok((Arc::new(mesh), std::iter::repeat_n(material, materials).collect(), Vec::new()))
    }

    fn light(&mut self, spec: &LightSpec, index: usize, at: &KeyPath) -> Option<Light> {
        let pose = self.noted(self.session.pose(&spec.pose), &at.key("pose"))?;
        let name = spec.name.clone().unwrap_or_else(|| format!("light[{index}]"));
        Some(Light { name, world: spec.world, pose, kind: spec.kind.light_kind() })
    }
}

type Made = (Arc<crate::mesh::Mesh>, Vec<Arc<Material>>, Vec<String>);

impl ShapeSpec {
    /// With the default number of segments where none is given.
    pub fn shape(&self) -> Shape {
        let segments = self.segments.unwrap_or(DEFAULT_SEGMENTS);
        match self.kind {
            ShapeKind::Box(size_m) => Shape::Box { size_m: vec3(size_m) },
            ShapeKind::Sphere(radius_m) => Shape::Sphere { radius_m: radius_m as f32, segments },
            ShapeKind::Plane(size_m) => Shape::Plane { size_m: vec2(size_m) },
            ShapeKind::Ring(ring) => Shape::Ring { size: ring.size(), segments },
            ShapeKind::Teapot(height_m) => {
                let segments = self.segments.unwrap_or(TEAPOT_SEGMENTS);
                Shape::Teapot { height_m: height_m as f32, segments }
            }
        }
    }
}

impl RingSpec {
    fn size(&self) -> RingSize {
        RingSize {
            inner_radius_m: self.inner_radius_m as f32,
            outer_radius_m: self.outer_radius_m as f32,
            height_m: self.height_m as f32,
            bevel_m: self.bevel_m as f32,
        }
    }
}

impl LightKindSpec {
    /// A strength that is to be measured is 1 for the time being.
    pub fn light_kind(&self) -> LightKind {
        let strength = |given: &Option<[f64; 3]>| given.map_or(Vec3::ONE, vec3);
        match self {
            Self::Spot { radiant_intensity, cone_deg, radius_m } => {
                let [inner, outer] = *cone_deg;
                LightKind::Spot(Spot {
                    radiant_intensity: strength(radiant_intensity),
                    inner_rad: inner.to_radians() as f32,
                    outer_rad: outer.to_radians() as f32,
                    radius_m: *radius_m as f32,
                })
            }
            Self::Area { size_m, radiance } => {
                LightKind::Rectangle(Rectangle { size_m: vec2(*size_m), radiance: strength(radiance) })
            }
        }
    }
}

impl MaterialSpec {
    /// A material with the keys that are given in place of its own; their textures go.
    pub fn applied_to(&self, material: &Material) -> Material {
        let mut changed = material.clone();
        self.change_base(&mut changed);
        self.change_body(&mut changed);
        if let Some(emissive) = self.emissive {
            changed.emissive = vec3(emissive);
            changed.emissive_strength = 1.0;
            changed.emissive_texture = None;
        }
        changed.double_sided = self.double_sided.unwrap_or(changed.double_sided);
        changed
    }

    fn change_base(&self, changed: &mut Material) {
        let metal = self.eta.zip(self.k).map(|(eta, k)| {
            Vec3::from_array([0, 1, 2].map(|i: usize| {
                let part = |of: [f64; 3]| of.get(i).copied().unwrap_or_default() as f32;
                fresnel_f0(part(eta), part(k))
            }))
        });
        if let Some(color) = self.base_color.map(vec3).or(metal) {
            changed.base_color = Vec4::from((color, changed.base_color.w));
            changed.base_color_texture = None;
        }
        if let Some(metallic) = self.metallic.or(metal.map(|_| 1.0)) {
            changed.metallic = metallic as f32;
            changed.metallic_roughness_texture = None;
        }
        // Perceptual roughness is the root of α.
        let roughness = self.phong_exponent.map(|exponent| alpha_from_phong(exponent as f32).sqrt());
        if let Some(roughness) = self.roughness.map(|roughness| roughness as f32).or(roughness) {
            changed.roughness = roughness;
            changed.metallic_roughness_texture = None;
        }
    }

    fn change_body(&self, changed: &mut Material) {
        if let Some(transmission) = self.transmission {
            changed.transmission = transmission as f32;
            changed.transmission_texture = None;
        }
        if let Some(ior) = self.ior {
            changed.ior = ior as f32;
        }
        if let Some(thickness_m) = self.thickness_m {
            changed.thickness_m = thickness_m as f32;
            changed.thickness_texture = None;
        }
        if let Some(color) = self.attenuation_color {
            changed.attenuation_color = vec3(color);
        }
        if let Some(distance_m) = self.attenuation_distance_m {
            changed.attenuation_distance_m = distance_m as f32;
        }
    }
}
