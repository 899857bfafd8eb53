//! Meshes: glTF, OBJ, PLY.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Context as _;
use coshade_scene::topology::Topology;
use coshade_scene::validity::{self, check_mesh};
use coshade_scene::{Imported, Material, import};
use serde_json::json;

use super::{Found, Problem, Severity};

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let imported = import(path)?;
    let Imported { mesh, materials, warnings, statistics } = &imported;
    let bounds = mesh.aabb().context("a mesh without vertices")?;
    let topology = Topology::of(mesh);
    let area_m2 = mesh.area_m2();
    let mut text = String::new();
    let _ = writeln!(
        text,
        "  {} triangles, {} vertices, {} parts, {} materials, {} textures",
        statistics.triangles, statistics.vertices, statistics.parts, statistics.materials, statistics.images
    );
    let (min, max) = (bounds.min, bounds.max);
    let size = max - min;
    let _ = writeln!(
        text,
        "  size {:.4} x {:.4} x {:.4} m, from ({:.4}, {:.4}, {:.4}) to ({:.4}, {:.4}, {:.4}), area {:.6} m2",
        size.x, size.y, size.z, min.x, min.y, min.z, max.x, max.y, max.z, area_m2
    );
    let _ = writeln!(
        text,
        "  {}, {} pieces (joined by edges), {} open edges, {} edges of more than two triangles",
        if topology.is_closed() { "closed" } else { "not closed" },
        topology.components.len(),
        topology.open_edges.len(),
        topology.non_manifold_edges.len()
    );
    for material in materials {
        let _ = writeln!(text, "  material {}", material_line(material));
    }
    let materials_of: Vec<&Material> = materials.iter().map(AsRef::as_ref).collect();
    let mut problems: Vec<_> =
        warnings.iter().map(|warning| Problem::new(Severity::Warning, warning.clone())).collect();
    problems.extend(check_mesh(mesh, &materials_of, 1.0).into_iter().map(|finding| {
        let severity = match finding.severity {
            validity::Severity::Note => Severity::Note,
            validity::Severity::Warning => Severity::Warning,
            validity::Severity::Error => Severity::Error,
        };
        Problem::new(severity, finding.text)
    }));
    let content = json!({
        "triangles": statistics.triangles,
        "vertices": statistics.vertices,
        "parts": statistics.parts,
        "textures": statistics.images,
        "min_m": min.to_array(),
        "max_m": max.to_array(),
        "area_m2": area_m2,
        "closed": topology.is_closed(),
        "pieces": topology.components.len(),
        "open_edges": topology.open_edges.len(),
        "non_manifold_edges": topology.non_manifold_edges.len(),
        "materials": materials.iter().map(|material| material_json(material)).collect::<Vec<_>>(),
    });
    Ok(Found { content, text, problems })
}

fn material_line(material: &Material) -> String {
    let name = if material.name.is_empty() { "(unnamed)" } else { &material.name };
    let [r, g, b, _] = material.base_color.to_array();
    let mut line = format!("{name}: base colour {r:.3} {g:.3} {b:.3}");
    let _ = write!(line, ", metallic {}, roughness {}", material.metallic, material.roughness);
    if material.transmission > 0.0 {
        let _ = write!(line, ", transmission {}, index {}", material.transmission, material.ior);
    }
    if material.emissive != glam::Vec3::ZERO {
        let [r, g, b] = (material.emissive * material.emissive_strength).to_array();
        let _ = write!(line, ", emits {r} {g} {b}");
    }
    line
}

fn material_json(material: &Material) -> serde_json::Value {
    json!({
        "name": material.name,
        "base_color": material.base_color.to_array(),
        "metallic": material.metallic,
        "roughness": material.roughness,
        "transmission": material.transmission,
        "ior": material.ior,
        "emitted_radiance": (material.emissive * material.emissive_strength).to_array(),
    })
}
