//! Primitives: attributes, triangles, and a node's transform baked in.

use ::gltf::json::validation::Checked;
use ::gltf::mesh::{Mode, Semantic};
use ::gltf::{Document, Mesh, Primitive};
use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};

use super::super::assemble::{Assembly, Piece};
use super::Fault;
use super::accessor::Reader;
use super::buffers::Buffers;
use super::materials::Materials;
use crate::normals;

/// Adds a primitive as it stands in the world.
pub(super) fn add(
    document: &Document,
    buffers: &Buffers<'_>,
    primitive: &Primitive<'_>,
    mesh: &Mesh<'_>,
    world_from_mesh: Mat4,
    materials: &mut Materials<'_>,
    assembly: &mut Assembly,
) -> Result<(), Fault> {
    let place = place_of(mesh, primitive);
    if matches!(primitive.mode(), Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
        assembly.warnings.push(format!("{place}: {:?} have no surface, left out", primitive.mode()));
        return Ok(());
    }
    let linear = Mat3::from_mat4(world_from_mesh);
    let scale = linear.determinant().abs().cbrt();
    let material = materials.slot(&primitive.material(), scale, assembly)?;
    let source = Source { document, buffers, primitive, mesh, place: &place };
    let mut piece = source.piece(material.uv_set, assembly)?;
    if piece.indices.is_empty() {
        assembly.warnings.push(format!("{place}: no triangles, left out"));
        return Ok(());
    }
    transform(&mut piece, world_from_mesh, linear);
    let repaired = normals::repair(&mut piece.normals, &piece.positions, &piece.indices);
    if repaired > 0 {
        assembly
            .warnings
            .push(format!("{place}: {repaired} normals are zero or not finite, smooth ones instead"));
    }
    assembly.add(piece, material.slot, &place)
}

fn place_of(mesh: &Mesh<'_>, primitive: &Primitive<'_>) -> String {
    let name = mesh.name().map(|name| format!(" '{name}'")).unwrap_or_default();
    format!("meshes[{}]{name}, primitive {}", mesh.index(), primitive.index())
}

struct Source<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    primitive: &'a Primitive<'a>,
    mesh: &'a Mesh<'a>,
    place: &'a str,
}

impl Source<'_> {
    fn piece(&self, uv_set: u32, assembly: &mut Assembly) -> Result<Piece, Fault> {
        let Some(positions) = self.reader(Semantic::Positions)? else {
            return Err(self.fault("no POSITION"));
        };
        let vertices = positions.count();
        let indices = self.indices(vertices, assembly)?;
        let flat = self.reader(Semantic::Normals)?.is_none();
        let unpacked = if flat { indices.len() } else { vertices };
        assembly.reserve(unpacked, indices.len() / 3, self.place)?;
        let mut piece =
            Piece { positions: vectors(&positions, Vec3::from_array)?, indices, ..Piece::default() };
        piece.normals = self.attribute(Semantic::Normals, vertices, |it| vectors(it, Vec3::from_array))?;
        piece.uvs =
            self.attribute(Semantic::TexCoords(uv_set), vertices, |it| vectors(it, Vec2::from_array))?;
        piece.colors = self.attribute(Semantic::Colors(0), vertices, |it| {
            Ok(it.colors()?.into_iter().map(Vec4::from_array).collect())
        })?;
        if !flat {
            piece.tangents =
                self.attribute(Semantic::Tangents, vertices, |it| vectors(it, Vec4::from_array))?;
        }
        if let Some(index) = piece.indices.iter().find(|&&index| index as usize >= vertices) {
            return Err(self.fault(format!("index {index}, but there are only {vertices} vertices")));
        }
        if uv_set > 0 && piece.uvs.is_empty() {
            assembly.warnings.push(format!(
                "{}: its material looks up TEXCOORD_{uv_set}, which it does not have",
                self.place
            ));
        }
        Ok(if flat { flat_shaded(&piece) } else { piece })
    }

    fn fault(&self, problem: impl Into<String>) -> Fault {
        Fault::new(self.place, problem)
    }

    /// Attributes are looked up in the JSON, because the crate's iterator panics on some unknown names.
    fn reader(&self, semantic: Semantic) -> Result<Option<Reader<'_>>, Fault> {
        let mesh = self.document.as_json().meshes.get(self.mesh.index());
        let primitive = mesh.and_then(|mesh| mesh.primitives.get(self.primitive.index()));
        let accessor = primitive.and_then(|primitive| primitive.attributes.get(&Checked::Valid(semantic)));
        accessor.map(|accessor| Reader::new(self.document, self.buffers, accessor.value())).transpose()
    }

    fn attribute<T>(
        &self,
        semantic: Semantic,
        vertices: usize,
        read: impl Fn(&Reader<'_>) -> Result<Vec<T>, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let name = semantic.to_string();
        let Some(reader) = self.reader(semantic)? else { return Ok(Vec::new()) };
        if reader.count() != vertices {
            let problem = format!("{name} has {} entries, POSITION has {vertices}", reader.count());
            return Err(self.fault(problem));
        }
        read(&reader)
    }

    /// Index triples, whatever way the triangles are strung together.
    fn indices(&self, vertices: usize, assembly: &mut Assembly) -> Result<Vec<u32>, Fault> {
        let list = match self.primitive.indices() {
            Some(accessor) => Reader::new(self.document, self.buffers, accessor.index())?.indices()?,
            None => (0..u32::try_from(vertices).unwrap_or(u32::MAX)).collect(),
        };
        match self.primitive.mode() {
            Mode::TriangleStrip => Ok(strip(&list)),
            Mode::TriangleFan => Ok(fan(&list)),
            _ => {
                let rest = list.len() % 3;
                if rest > 0 {
                    let warning =
                        format!("{}: {} indices, the last {rest} make no triangle", self.place, list.len());
                    assembly.warnings.push(warning);
                }
                Ok(list.chunks_exact(3).flatten().copied().collect())
            }
        }
    }
}

fn vectors<const N: usize, T>(reader: &Reader<'_>, vector: impl Fn([f32; N]) -> T) -> Result<Vec<T>, Fault> {
    Ok(reader.floats::<N>()?.into_iter().map(vector).collect())
}

/// glTF 2.0, section 3.7.2.1: `(i, i + (1 + i mod 2), i + (2 − i mod 2))`.
fn strip(list: &[u32]) -> Vec<u32> {
    let turned = |(i, w): (usize, &[u32])| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
    list.windows(3).enumerate().flat_map(turned).collect()
}

/// `(i + 1, i + 2, 0)`.
fn fan(list: &[u32]) -> Vec<u32> {
    let Some((&first, rest)) = list.split_first() else { return Vec::new() };
    rest.windows(2).flat_map(|pair| [pair[0], pair[1], first]).collect()
}

/// Each triangle with corners and a normal of its own, as glTF asks for where there are no normals.
fn flat_shaded(piece: &Piece) -> Piece {
    let at = |index: &u32| *index as usize;
    let mut flat = Piece {
        positions: piece.indices.iter().map(|index| piece.positions[at(index)]).collect(),
        indices: (0..piece.indices.len() as u32).collect(),
        ..Piece::default()
    };
    if !piece.uvs.is_empty() {
        flat.uvs = piece.indices.iter().map(|index| piece.uvs[at(index)]).collect();
    }
    if !piece.colors.is_empty() {
        flat.colors = piece.indices.iter().map(|index| piece.colors[at(index)]).collect();
    }
    let triangles = flat.positions.chunks_exact(3);
    flat.normals = triangles.flat_map(|corner| [normals::flat(corner[0], corner[1], corner[2]); 3]).collect();
    flat
}

/// Bakes a transform in. A mirroring one (negative determinant) turns the winding around, so that fronts stay fronts.
fn transform(piece: &mut Piece, world_from_mesh: Mat4, linear: Mat3) {
    let mirrored = linear.determinant() < 0.0;
    let handed = if mirrored { -1.0 } else { 1.0 };
    // The inverse transpose up to a positive factor; columns are cross products, so a flattened mesh works as well.
    let cofactors = Mat3::from_cols(
        linear.y_axis.cross(linear.z_axis),
        linear.z_axis.cross(linear.x_axis),
        linear.x_axis.cross(linear.y_axis),
    ) * handed;
    for position in &mut piece.positions {
        *position = world_from_mesh.transform_point3(*position);
    }
    for normal in &mut piece.normals {
        *normal = (cofactors * *normal).normalize_or_zero();
    }
    for tangent in &mut piece.tangents {
        let direction = (linear * tangent.truncate()).normalize_or_zero();
        *tangent = direction.extend(if tangent.w < 0.0 { -handed } else { handed });
    }
    if mirrored {
        piece.indices.chunks_exact_mut(3).for_each(|corners| corners.swap(1, 2));
    }
}
