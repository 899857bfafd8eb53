//! What is wrong, or looks wrong, with a mesh.
//!
//! Nothing here stops a session: findings are shown, each with a count and a few places to look at.

use std::fmt;

use glam::{DVec3, Vec3};

use crate::material::Material;
use crate::mesh::Mesh;
use crate::thing::Thing;
use crate::topology::{Component, Topology};

/// Places shown with a finding, at most.
const EXAMPLES: usize = 3;
/// Triangles lower than this share of their longest side are degenerate: f32 corners cannot give them a normal.
const FLATTEST: f64 = 1e-7;
/// Normals may be off unit length by this much (8-bit normals of files are off by up to 0.4%).
const UNIT_TOLERANCE: f32 = 0.01;
/// Larger than this, or smaller than the next, a thing on a desk has the wrong unit, metres.
const LARGEST_M: f32 = 100.0;
/// See [`LARGEST_M`].
const SMALLEST_M: f32 = 1e-4;

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// May well be meant.
    Note,
    /// The picture will probably be wrong.
    Warning,
    /// The mesh cannot be drawn as it is.
    Error,
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Problem {
    /// No triangles at all.
    Empty,
    /// Attributes of different lengths, indices or parts out of range.
    Structure,
    /// Fewer materials than the mesh has slots.
    MissingMaterial,
    /// Positions that are NaN or infinite.
    NotFinite,
    /// Normals that are not of unit length.
    NotUnitNormals,
    /// Triangles without an area.
    Degenerate,
    /// A refractor's edges of one triangle only.
    Open,
    /// A refractor's edges of three or more triangles.
    NonManifold,
    /// A refractor's neighbours that wind in opposite senses.
    Flipped,
    /// A closed refractor whose front is inside.
    Inward,
    /// Normals on the back of their triangle.
    NormalsAgainstWinding,
    /// Texture coordinates that show a picture mirrored.
    MirroredUv,
    /// Larger than 100 m.
    Huge,
    /// Smaller than 0.1 mm.
    Tiny,
}

/// Something found, with how often and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What.
    pub problem: Problem,
    /// How bad.
    pub severity: Severity,
    /// Number of vertices, edges or triangles concerned.
    pub count: usize,
    /// A few of them, in the mesh's own frame, metres.
    pub examples: Vec<Vec3>,
    /// One sentence, with what to do.
    pub text: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)?;
        for (i, place) in self.examples.iter().enumerate() {
            let before = if i == 0 { "; for example at" } else { "," };
            write!(f, "{before} ({:.4}, {:.4}, {:.4})", place.x, place.y, place.z)?;
        }
        Ok(())
    }
}

/// Findings about a thing, the worst first; empty if all is well.
pub fn check_thing(thing: &Thing) -> Vec<Finding> {
    let materials: Vec<&Material> = thing.materials.iter().map(AsRef::as_ref).collect();
    check_mesh(&thing.mesh, &materials, thing.pose.frame_from_thing().scale)
}

/// Findings about a mesh of these materials that is drawn `scale` times as large, the worst first.
pub fn check_mesh(mesh: &Mesh, materials: &[&Material], scale: f32) -> Vec<Finding> {
    if let Err(error) = mesh.check() {
        return vec![finding(Problem::Structure, Severity::Error, 1, Vec::new(), error.to_string())];
    }
    if mesh.indices.is_empty() {
        return vec![finding(
            Problem::Empty,
            Severity::Error,
            0,
            Vec::new(),
            "the mesh has no triangles".to_owned(),
        )];
    }
    let mut findings = Vec::new();
    findings.extend(missing_materials(mesh, materials));
    findings.extend(not_finite(mesh));
    findings.extend(normal_lengths(mesh));
    findings.extend(triangle_findings(mesh));
    findings.extend(refractor_findings(mesh, materials));
    findings.extend(size(mesh, scale));
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    findings
}

fn finding(problem: Problem, severity: Severity, count: usize, examples: Vec<Vec3>, text: String) -> Finding {
    Finding { problem, severity, count, examples, text }
}

fn missing_materials(mesh: &Mesh, materials: &[&Material]) -> Option<Finding> {
    let slots = mesh.material_slots();
    let text = || format!("the mesh has {slots} material slots, but there are {} materials", materials.len());
    (slots > materials.len()).then(|| {
        finding(Problem::MissingMaterial, Severity::Error, slots - materials.len(), Vec::new(), text())
    })
}

fn not_finite(mesh: &Mesh) -> Option<Finding> {
    let count = mesh.positions.iter().filter(|position| !position.is_finite()).count();
    let text = || format!("{count} vertices are not finite (NaN or infinite): export the mesh again");
    (count > 0).then(|| finding(Problem::NotFinite, Severity::Error, count, Vec::new(), text()))
}

fn normal_lengths(mesh: &Mesh) -> Option<Finding> {
    let unit = |normal: &Vec3| (normal.length() - 1.0).abs() <= UNIT_TOLERANCE;
    let mut tally = Tally::default();
    let pairs = mesh.normals.iter().zip(&mesh.positions);
    pairs.filter(|(normal, _)| !unit(normal)).for_each(|(_, position)| tally.add(*position));
    let text = |count| format!("{count} normals are not of unit length");
    tally.finding(Problem::NotUnitNormals, Severity::Warning, text)
}

/// A count with the first few places.
#[derive(Default)]
struct Tally {
    count: usize,
    examples: Vec<Vec3>,
}

impl Tally {
    fn add(&mut self, place: Vec3) {
        self.count += 1;
        if self.examples.len() < EXAMPLES {
            self.examples.push(place);
        }
    }

    fn finding(
        self,
        problem: Problem,
        severity: Severity,
        text: impl Fn(usize) -> String,
    ) -> Option<Finding> {
        (self.count > 0).then(|| finding(problem, severity, self.count, self.examples, text(self.count)))
    }
}

fn triangle_findings(mesh: &Mesh) -> impl Iterator<Item = Finding> {
    let [mut degenerate, mut against, mut mirrored] = <[Tally; 3]>::default();
    for (corners, [a, b, c]) in mesh.triangles().zip(mesh.triangle_positions()) {
        let Some(facing) = facing(a, b, c) else {
            if a.is_finite() && b.is_finite() && c.is_finite() {
                degenerate.add(a);
            }
            continue;
        };
        let middle = (a + b + c) / 3.0;
        let normals = corners.iter().filter_map(|&corner| mesh.normals.get(corner as usize));
        if normals.map(|normal| normal.as_dvec3().dot(facing)).sum::<f64>() < 0.0 {
            against.add(middle);
        }
        let uv = |corner: u32| mesh.uvs.get(corner as usize).copied();
        if let [Some(a), Some(b), Some(c)] = corners.map(uv)
            && (b - a).perp_dot(c - a) > 0.0
        {
            mirrored.add(middle);
        }
    }
    let all = mesh.triangle_count();
    [
        degenerate.finding(Problem::Degenerate, Severity::Note, |count| {
            format!("{count} of {all} triangles are degenerate (no area)")
        }),
        against.finding(Problem::NormalsAgainstWinding, Severity::Warning, |count| {
            let advice =
                if 2 * count > all { "flip the faces or the normals" } else { "make the winding consistent" };
            format!("{count} of {all} triangles have normals on their back: {advice}")
        }),
        mirrored.finding(Problem::MirroredUv, Severity::Note, |count| {
            format!("{count} of {all} triangles show their texture mirrored")
        }),
    ]
    .into_iter()
    .flatten()
}

/// Unit normal by winding; `None` if the triangle is degenerate or not finite.
fn facing(a: Vec3, b: Vec3, c: Vec3) -> Option<DVec3> {
    let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
    let doubled_area = (b - a).cross(c - a);
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (doubled_area.length() > FLATTEST * longest).then(|| doubled_area.try_normalize()).flatten()
}

/// Light can only be bent by a body that has an inside: closed, manifold, with its front outside. A thin-walled
/// material (thickness 0) does not bend light, there it may be meant.
fn refractor_findings(mesh: &Mesh, materials: &[&Material]) -> Vec<Finding> {
    let of = |slot: usize| materials.get(slot).filter(|material| material.transmission > 0.0);
    let parts: Vec<_> = mesh.parts.iter().filter(|part| of(part.material).is_some()).collect();
    if parts.is_empty() {
        return Vec::new();
    }
    let solid = parts.iter().any(|part| of(part.material).is_some_and(|material| material.is_refractor()));
    let mut topology = Topology::of_triangles(mesh, parts.iter().map(|part| part.triangles.clone()));
    if !topology.is_closed() {
        // Opaque parts may close it, as a cork closes a bottle.
        let whole = Topology::of(mesh);
        if whole.is_closed() {
            topology = whole;
        }
    }
    let severity = if solid { Severity::Warning } else { Severity::Note };
    let edge_kinds = [
        (Problem::Open, &topology.open_edges, "of one triangle only: the refractor has holes, close them"),
        (
            Problem::NonManifold,
            &topology.non_manifold_edges,
            "of more than two triangles: its inside is not defined there",
        ),
        (
            Problem::Flipped,
            &topology.flipped_edges,
            "between triangles of opposite winding: make the winding consistent",
        ),
    ];
    let mut findings: Vec<Finding> = edge_kinds
        .into_iter()
        .filter(|(_, edges, _)| !edges.is_empty())
        .map(|(problem, edges, what)| {
            let examples = edges.iter().take(EXAMPLES).map(|[a, b]| a.midpoint(*b)).collect();
            finding(problem, severity, edges.len(), examples, format!("{} edges {what}", edges.len()))
        })
        .collect();
    if topology.is_closed() {
        findings.extend(inward(&topology.components, severity));
    }
    findings
}

/// Closed pieces that wind inward, unless they lie within another one: the inner wall of a hollow body should.
fn inward(components: &[Component], severity: Severity) -> Option<Finding> {
    let within = |inner: &Component, outer: &Component| {
        inner.min.cmpgt(outer.min).all() && inner.max.cmplt(outer.max).all()
    };
    let outward = |other: &&Component| other.volume_m3 > 0.0;
    let is_cavity = |piece: &Component| components.iter().filter(outward).any(|outer| within(piece, outer));
    let mut tally = Tally::default();
    let wrong = components.iter().filter(|piece| piece.volume_m3 < 0.0 && !is_cavity(piece));
    wrong.for_each(|piece| tally.add(piece.min.midpoint(piece.max)));
    tally.finding(Problem::Inward, severity, |count| {
        format!("{count} closed pieces of the refractor wind inward: flip their faces")
    })
}

fn size(mesh: &Mesh, scale: f32) -> Option<Finding> {
    let aabb = mesh.aabb()?;
    let longest_m = aabb.size().max_element() * scale;
    let found =
        |problem, text: String| Some(finding(problem, Severity::Warning, 1, vec![aabb.center()], text));
    if longest_m > LARGEST_M {
        let text = format!(
            "the thing is {longest_m:.0} m long; if its file is in millimetres, set scale = 0.001, in centimetres 0.01"
        );
        return found(Problem::Huge, text);
    }
    if longest_m < SMALLEST_M {
        let text =
            format!("the thing is only {:.2e} m long: check its unit and the scale of its pose", longest_m);
        return found(Problem::Tiny, text);
    }
    None
}

#[cfg(test)]
mod tests;
