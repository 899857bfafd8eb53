//! A scene for Mitsuba 3 (W. Jakob et al., *Mitsuba 3 renderer*, 2022): a path tracer that shares nothing with this one,
//! to compare with.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`sensor`] | the camera |
//! | [`material`] | which materials have an exact counterpart |
//! | [`light`] | lamps and the environment |
//! | [`ply`] | meshes, in world coordinates |
//! | [`xml`] | the scene file |
//!
//! The world is the same: right-handed, +Z up, metres. Mitsuba's `max_depth` counts segments, ours scattering events: its
//! is one more.

pub mod light;
pub mod material;
pub mod ply;
pub mod sensor;
pub mod xml;

use std::fs;
use std::path::{Path, PathBuf};

use coshade_scene::{LightKind, Pose, Scene, Similarity, Thing};
use thiserror::Error;

use crate::camera::Camera;
use crate::emitter::{Environment, Layout};
use crate::integrator::Settings;
use coshade_image_file::{Image, ImageError, LayeredImage, Precision, write_exr};
use xml::Element;

/// Folder of the meshes, beside the scene file.
const MESHES: &str = "meshes";
/// The environment, beside the scene file.
const ENVIRONMENT: &str = "environment.exr";

/// Why a scene cannot be exported.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The lens.
    #[error("camera: {0}")]
    Camera(String),
    /// A thing.
    #[error("thing '{thing}': {what}")]
    Thing {
        /// Its name.
        thing: String,
        /// What is wrong, and what to do.
        what: String,
    },
    /// A light.
    #[error("light '{light}': {what}")]
    Light {
        /// Its name.
        light: String,
        /// What is wrong, and what to do.
        what: String,
    },
    /// The environment.
    #[error("environment: only lat-long maps are exported")]
    Environment,
    /// An image that cannot be made or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A file that cannot be written.
    #[error("{path}: {source}")]
    Write {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// A scene in Mitsuba's words, ready to be written.
#[derive(Clone, Debug)]
pub struct MitsubaScene {
    root: Element,
    /// File names and contents.
    meshes: Vec<(String, Vec<u8>)>,
    environment: Option<Image>,
    approximations: Vec<String>,
}

impl MitsubaScene {
    /// Translates a scene: the real world, or with `mixed` the one with all virtual things and lights in it.
    ///
    /// # Errors
    /// [`ExportError`] names what Mitsuba has no counterpart for.
    pub fn new(
        scene: &Scene,
        environment: Option<&Environment>,
        camera: &Camera,
        mixed: bool,
    ) -> Result<Self, ExportError> {
        let mut made = Self {
            root: Element::new("scene").attribute("version", "3.0.0"),
            meshes: Vec::new(),
            environment: None,
            approximations: Vec::new(),
        };
        let mut contents = Vec::new();
        let mut absorbs = false;
        for thing in scene.things.iter().filter(|thing| mixed || thing.world.is_real()) {
            absorbs |= made.add_thing(thing, &mut contents)?;
        }
        for light in scene.lights.iter().filter(|light| mixed || light.world.is_real()) {
            let world_from_light = placed(&light.pose)
                .map_err(|what| ExportError::Light { light: light.name.clone(), what: what.to_owned() })?;
            if matches!(light.kind, LightKind::Spot(_)) {
                made.approximations.push(format!("light '{}': {}", light.name, light::SPOT_APPROXIMATION));
            }
            contents.push(light::lamp(&light.kind, &world_from_light));
        }
        if let Some(environment) = environment {
            if environment.layout() != Layout::LatLong {
                return Err(ExportError::Environment);
            }
            made.environment = Some(light::environment_image(environment)?);
            contents.push(light::environment(environment, ENVIRONMENT));
        }
        let sensor = sensor::sensor(camera).map_err(ExportError::Camera)?;
        let head =
            [default("spp", "64"), default("max_depth", &(Settings::default().max_depth + 1).to_string())];
        // Only the volumetric one looks at media.
        let integrator = Element::plugin("integrator", if absorbs { "volpath" } else { "path" }).parameter(
            "integer",
            "max_depth",
            "$max_depth",
        );
        let all = head.into_iter().chain([integrator, sensor]).chain(contents);
        made.root = all.fold(made.root, Element::child);
        Ok(made)
    }

    /// What Mitsuba will show differently, by name of thing or light.
    pub fn approximations(&self) -> &[String] {
        &self.approximations
    }

    /// Writes the scene file and beside it the meshes and the environment. Folders are made.
    ///
    /// # Errors
    /// [`ExportError`] with the file that cannot be written.
    pub fn write(&self, xml: &Path) -> Result<(), ExportError> {
        let folder = xml.parent().unwrap_or(Path::new(""));
        let at = |path: &Path, result: std::io::Result<()>| {
            result.map_err(|source| ExportError::Write { path: path.to_owned(), source })
        };
        let meshes = folder.join(MESHES);
        at(&meshes, fs::create_dir_all(&meshes))?;
        for (name, bytes) in &self.meshes {
            let path = meshes.join(name);
            at(&path, fs::write(&path, bytes))?;
        }
        if let Some(image) = &self.environment {
            write_exr(folder.join(ENVIRONMENT), &LayeredImage::single(image.clone()), Precision::Float)?;
        }
        at(xml, fs::write(xml, format!("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n{}", self.root)))
    }

    /// True if its body absorbs.
    fn add_thing(&mut self, thing: &Thing, contents: &mut Vec<Element>) -> Result<bool, ExportError> {
        let refused = |what: String| ExportError::Thing { thing: thing.name.clone(), what };
        thing.mesh.check().map_err(|error| refused(error.to_string()))?;
        if !thing.mesh.colors.is_empty() {
            return Err(refused("vertex colours are not exported: use a mesh without them".to_owned()));
        }
        let world_from_thing = placed(&thing.pose).map_err(|what| refused(what.to_owned()))?;
        let mut absorbs = false;
        for (slot, material) in thing.materials.iter().enumerate() {
            let Some(bytes) = ply::bytes(&thing.mesh, slot, &world_from_thing) else { continue };
            let mapped = material::map(material).map_err(|what| refused(what.to_owned()))?;
            let said = mapped.approximations.iter().map(|what| format!("thing '{}': {what}", thing.name));
            self.approximations.extend(said);
            absorbs |= mapped.interior.is_some();
            let name = format!("{:03}.ply", self.meshes.len());
            let shape = Element::plugin("shape", "ply")
                .attribute("id", format_args!("{} {slot}", thing.name.replace('.', "_")))
                .parameter("string", "filename", format_args!("{MESHES}/{name}"))
                .child(mapped.bsdf);
            let parts = mapped.interior.into_iter().chain(mapped.emitter);
            contents.push(parts.fold(shape, Element::child));
            self.meshes.push((name, bytes));
        }
        Ok(absorbs)
    }
}

fn placed(pose: &Pose) -> Result<Similarity, &'static str> {
    let world_from_thing = pose.resolve(|_| None);
    world_from_thing.ok_or("it is attached to a tag that has not been seen: state its pose in the world")
}

fn default(name: &str, value: &str) -> Element {
    Element::new("default").attribute("name", name).attribute("value", value)
}

#[cfg(test)]
mod tests;
