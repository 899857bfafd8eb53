//! glTF 2.0, as `.glb` or as `.gltf` with buffers beside it or in data URIs.
//!
//! The `gltf` crate parses and validates the JSON; bytes are read here, because its reader panics on some broken
//! files (a header shorter than itself, a POSITION accessor that does not exist) and follows any path.

mod accessor;
mod buffers;
mod container;
mod materials;
mod nodes;
mod primitive;

use std::path::Path;

use ::gltf::Document;
use ::gltf::json::validation::{Checked, Error as Invalid, Validate};
use ::gltf::json::{self, Root};
use ::gltf::mesh::Semantic;

use super::assemble::Assembly;
use super::error::Fault;
use super::{ImportOptions, Imported};
use buffers::Buffers;
use materials::Materials;

/// Extensions that are carried out.
const SUPPORTED: [&str; 6] = [
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Reads a document; everything it shows in its default scene becomes one mesh.
pub(super) fn read(folder: &Path, bytes: &[u8], _options: &ImportOptions) -> Result<Imported, Fault> {
    let container = container::split(bytes)?;
    let root: Root = json::deserialize::from_slice(container.json).map_err(|error| {
        Fault::new(format!("JSON, line {}, column {}", error.line(), error.column()), error.to_string())
    })?;
    check(&root)?;
    let mut assembly = Assembly::default();
    assembly.warnings = ignored_features(&root);
    let document = Document::from_json_without_validation(root);
    let buffers = Buffers::read(&document, container.binary, folder)?;
    let mut materials = Materials::new(&document, &buffers, folder);
    nodes::add_all(&document, &buffers, &mut materials, &mut assembly)?;
    assembly.warnings.append(&mut materials.warnings);
    assembly.finish(materials.image_count())
}

/// What the rest relies on: all references lead somewhere, all enums are known.
fn check(root: &Root) -> Result<(), Fault> {
    for name in &root.extensions_required {
        if !SUPPORTED.contains(&name.as_str()) {
            let problem = format!("the file requires {name}, which is not supported{}", advice(name));
            return Err(Fault::new("extensionsRequired", problem));
        }
    }
    check_positions(root)?;
    let mut first: Option<(String, Invalid)> = None;
    root.validate(root, json::Path::new, &mut |path, error| {
        let place = path().to_string();
        // Required extensions are judged above; bounds of positions are not used, so they may be missing.
        let harmless = place.starts_with("extensionsRequired")
            || place.ends_with("[\"POSITION\"].min")
            || place.ends_with("[\"POSITION\"].max");
        if !harmless && first.is_none() {
            first = Some((place, error));
        }
    });
    first.map_or(Ok(()), |(place, error)| Err(Fault::new(place, error.to_string())))
}

/// The crate's own validation looks these up without asking whether they are there.
fn check_positions(root: &Root) -> Result<(), Fault> {
    for (mesh_number, mesh) in root.meshes.iter().enumerate() {
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("meshes[{mesh_number}].primitives[{number}].attributes.POSITION");
            match primitive.attributes.get(&Checked::Valid(Semantic::Positions)) {
                None => return Err(Fault::new(place, "missing")),
                Some(index) if index.value() >= root.accessors.len() => {
                    let problem =
                        format!("accessor {}, but there are only {}", index.value(), root.accessors.len());
                    return Err(Fault::new(place, problem));
                }
                Some(_) => {}
            }
        }
    }
    Ok(())
}

fn advice(extension: &str) -> &'static str {
    match extension {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            ": export it without compression"
        }
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" | "MSFT_texture_dds" => {
            ": export it with PNG or JPEG pictures"
        }
        _ => "",
    }
}

fn ignored_features(root: &Root) -> Vec<String> {
    let mut warnings: Vec<String> = Vec::new();
    for name in &root.extensions_used {
        if !SUPPORTED.contains(&name.as_str()) {
            warnings.push(format!("extensionsUsed: {name} is ignored{}", advice(name)));
        }
    }
    let mut ignored = |count: usize, what: &str| {
        if count > 0 {
            warnings.push(format!("{what} ({count}): ignored, the mesh is shown as it is stored"));
        }
    };
    ignored(root.animations.len(), "animations");
    ignored(root.skins.len(), "skins");
    let primitives = || root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    ignored(
        primitives().filter(|primitive| primitive.targets.as_ref().is_some_and(|t| !t.is_empty())).count(),
        "morph targets",
    );
    let occlusion = root.materials.iter().filter(|material| material.occlusion_texture.is_some()).count();
    if occlusion > 0 {
        warnings.push(format!("occlusion textures ({occlusion}): ignored, occlusion is computed"));
    }
    warnings
}
