//! Wavefront material libraries, with the PBR extension (`Pr`, `Pm`, `norm`).

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::error::Fault;
use super::text::{Line, shortened};
use super::{files, picture};
use crate::material::{AlphaMode, Material, NormalMap, alpha_from_phong};
use crate::texture::{ColorSpace, Image, Texture, Wrap};

/// Materials by name.
#[derive(Default)]
pub(super) struct Library {
    materials: HashMap<String, Material>,
    pictures: HashMap<String, Arc<Image>>,
}

impl Library {
    /// The material of this name; a plain grey one, with a warning, if it is not there.
    pub fn take(&self, name: Option<&str>, warnings: &mut Vec<String>) -> Material {
        let Some(name) = name else { return Material::default() };
        self.materials.get(name).cloned().unwrap_or_else(|| {
            warnings.push(format!("material '{}' is in no library, grey instead", shortened(name)));
            Material { name: name.to_owned(), ..Material::default() }
        })
    }

    /// Number of pictures decoded.
    pub fn images(&self) -> usize {
        self.pictures.len()
    }
}

/// Adds the libraries that a `mtllib` line names. One that is missing is a warning; one outside the folder an error.
pub(super) fn read_into(
    library: &mut Library,
    folder: &Path,
    names: &str,
    place: &str,
    warnings: &mut Vec<String>,
) -> Result<(), Fault> {
    // Several names may follow each other, but one with spaces in it is the commoner case.
    let whole = folder.join(names).is_file();
    let names: Vec<&str> = if whole { vec![names] } else { names.split_ascii_whitespace().collect() };
    for name in names {
        files::inside(name, place)?;
        let bytes = match files::read_beside(folder, name, place) {
            Ok(bytes) => bytes,
            Err(missing) => {
                warnings.push(format!("{}: {}, grey instead", missing.place, missing.problem));
                continue;
            }
        };
        let mut parser = Parser { library, folder, name, current: None, rough_given: false, warnings };
        for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
            let text = String::from_utf8_lossy(line.trim_ascii());
            let line = Line { number: number + 1, text: &text };
            parser
                .line(&line)
                .map_err(|fault| Fault::new(format!("{name}, {}", fault.place), fault.problem))?;
        }
        parser.close();
    }
    Ok(())
}

struct Parser<'a> {
    library: &'a mut Library,
    folder: &'a Path,
    name: &'a str,
    current: Option<Material>,
    rough_given: bool,
    warnings: &'a mut Vec<String>,
}

impl Parser<'_> {
    fn line(&mut self, line: &Line<'_>) -> Result<(), Fault> {
        let mut words = line.text.split_ascii_whitespace();
        let Some(keyword) = words.next().filter(|word| !word.starts_with('#')) else { return Ok(()) };
        let rest = line.text.strip_prefix(keyword).unwrap_or_default().trim_ascii();
        let words: Vec<&str> = words.collect();
        if keyword == "newmtl" {
            self.close();
            self.current = Some(Material { name: rest.to_owned(), ..Material::default() });
            self.rough_given = false;
            return Ok(());
        }
        let Some(material) = self.current.as_mut() else {
            return Err(line.fault(format!("'{}' before the first newmtl", shortened(keyword))));
        };
        let number = || line.floats::<1>(&words).map(|[number]| number);
        match keyword {
            "Kd" => material.base_color = color(line, &words)?.extend(material.base_color.w),
            "Ke" => material.emissive = color(line, &words)?,
            "d" => material.base_color.w = number()?,
            "Tr" => material.base_color.w = 1.0 - number()?,
            "Ni" => material.ior = number()?,
            "Pm" => material.metallic = number()?,
            "Pr" => {
                material.roughness = number()?;
                self.rough_given = true;
            }
            "Ns" if !self.rough_given => material.roughness = alpha_from_phong(number()?.max(0.0)).sqrt(),
            "map_Kd" => {
                if let Some(texture) = self.texture(line, &words, ColorSpace::Srgb) {
                    self.with(|material| material.base_color_texture = Some(texture));
                }
            }
            "map_Ke" => {
                if let Some(texture) = self.texture(line, &words, ColorSpace::Srgb) {
                    self.with(|material| material.emissive_texture = Some(texture));
                }
            }
            "norm" => {
                if let Some(texture) = self.texture(line, &words, ColorSpace::Linear) {
                    self.with(|material| material.normal_map = Some(NormalMap { texture, scale: 1.0 }));
                }
            }
            // Ambient and specular colours and illumination models say nothing a metallic-roughness material can keep.
            "Ka" | "Ks" | "Ns" | "illum" | "Tf" | "sharpness" => {}
            other => self.warn(line, &format!("'{}' is ignored", shortened(other))),
        }
        Ok(())
    }

    fn with(&mut self, change: impl FnOnce(&mut Material)) {
        if let Some(material) = &mut self.current {
            change(material);
        }
    }

    fn warn(&mut self, line: &Line<'_>, text: &str) {
        self.warnings.push(format!("{}, line {}: {text}", self.name, line.number));
    }

    fn close(&mut self) {
        let Some(mut material) = self.current.take() else { return };
        if let Err(problem) = material.check() {
            self.warnings.push(format!("{}: {problem}; brought into range", self.name));
            clamp(&mut material);
        }
        if material.base_color.w < 1.0 {
            material.alpha_mode = AlphaMode::Blend;
        }
        self.library.materials.insert(material.name.clone(), material);
    }

    /// Paths into the author's own disk are common: a picture that is not here is a warning.
    fn texture(&mut self, line: &Line<'_>, words: &[&str], space: ColorSpace) -> Option<Arc<Texture>> {
        let options = match Options::parse(words) {
            Ok(options) => options,
            Err(problem) => {
                self.warn(line, &problem);
                return None;
            }
        };
        let place = format!("{}, line {}", self.name, line.number);
        let image = match self.picture(&options.file, &place) {
            Ok(image) => image,
            Err(fault) => {
                self.warnings.push(format!("{}: {}, no texture", fault.place, fault.problem));
                return None;
            }
        };
        let mut texture = Texture::new(image, space);
        // v is turned at import, and with it offset and scale.
        texture.uv_transform.scale = options.scale;
        texture.uv_transform.offset = Vec2::new(options.offset.x, 1.0 - options.scale.y - options.offset.y);
        if options.clamp {
            (texture.wrap_u, texture.wrap_v) = (Wrap::ClampToEdge, Wrap::ClampToEdge);
        }
        Some(Arc::new(texture))
    }

    fn picture(&mut self, file: &str, place: &str) -> Result<Arc<Image>, Fault> {
        if let Some(image) = self.library.pictures.get(file) {
            return Ok(image.clone());
        }
        let bytes = files::read_beside(self.folder, file, place)?;
        let (image, note) = picture::decode(&bytes, file, place)?;
        self.warnings.extend(note);
        let image = Arc::new(image);
        self.library.pictures.insert(file.to_owned(), image.clone());
        Ok(image)
    }
}

fn color(line: &Line<'_>, words: &[&str]) -> Result<Vec3, Fault> {
    if let [grey] = words {
        return line.float(grey).map(Vec3::splat);
    }
    line.floats(words).map(Vec3::from_array)
}

fn clamp(material: &mut Material) {
    let unit = |value: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
    material.base_color = material.base_color.map(unit);
    material.emissive = material.emissive.map(|part| if part.is_finite() { part.max(0.0) } else { 0.0 });
    material.metallic = unit(material.metallic);
    material.roughness = unit(material.roughness);
    if !(material.ior.is_finite() && material.ior >= 1.0) {
        material.ior = 1.5;
    }
}

/// What stands before the file name of a texture map.
struct Options {
    file: String,
    offset: Vec2,
    scale: Vec2,
    clamp: bool,
}

impl Options {
    fn parse(words: &[&str]) -> Result<Self, String> {
        let mut options = Self { file: String::new(), offset: Vec2::ZERO, scale: Vec2::ONE, clamp: false };
        let mut rest = words;
        while let Some((option, behind)) = rest.split_first().filter(|(word, _)| word.starts_with('-')) {
            let numbers: Vec<f32> = behind.iter().map_while(|word| word.parse().ok()).take(3).collect();
            let vector = |default: f32| {
                let at = |i: usize| numbers.get(i).copied().unwrap_or(default);
                Vec2::new(at(0), at(1))
            };
            let taken = match *option {
                "-o" | "-s" | "-t" | "-mm" => numbers.len(),
                "-bm" | "-boost" | "-texres" | "-blendu" | "-blendv" | "-cc" | "-clamp" | "-imfchan"
                | "-type" => 1,
                unknown => return Err(format!("option '{}' is not known, no texture", shortened(unknown))),
            };
            match *option {
                "-o" => options.offset = vector(0.0),
                "-s" => options.scale = vector(1.0),
                "-clamp" => options.clamp = behind.first() == Some(&"on"),
                _ => {}
            }
            rest = behind.get(taken..).unwrap_or_default();
        }
        options.file = rest.join(" ");
        if options.file.is_empty() || !options.offset.is_finite() || !options.scale.is_finite() {
            return Err("a texture map without a file name, or with options that are not finite".to_owned());
        }
        Ok(options)
    }
}
