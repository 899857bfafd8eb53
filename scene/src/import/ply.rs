//! Stanford PLY: ASCII and binary of either byte order, polygons and triangle strips.
//!
//! Read here rather than by a crate so that counts are checked before memory is asked for, and errors name the element.

mod header;
mod values;

use std::path::Path;

use glam::{Vec2, Vec3, Vec4};

use super::assemble::{Assembly, Piece};
use super::error::Fault;
use super::obj::turned;
use super::{ImportOptions, Imported, MAX_TRIANGLES, MAX_VERTICES, MissingNormals};
use crate::material::Material;
use crate::texture::srgb_to_linear;
use crate::{normals, polygon};
use header::{Element, Header, Kind};
use values::Values;

/// Reads a file.
pub(super) fn read(_folder: &Path, bytes: &[u8], options: &ImportOptions) -> Result<Imported, Fault> {
    let (header, body) = Header::read(bytes)?;
    let mut values = Values::new(&header, body);
    let mut reader = Reader::default();
    for element in &header.elements {
        reader.element(element, &mut values)?;
    }
    reader.finish(options)
}

#[derive(Default)]
struct Reader {
    piece: Piece,
    faces: Vec<Vec<u32>>,
    strips: Vec<[u32; 3]>,
    corners: usize,
    warnings: Vec<String>,
}

/// What a vertex property means.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Position(usize),
    Normal(usize),
    Uv(usize),
    Color(usize),
    Other,
}

fn role(name: &str) -> Role {
    match name {
        "x" => Role::Position(0),
        "y" => Role::Position(1),
        "z" => Role::Position(2),
        "nx" => Role::Normal(0),
        "ny" => Role::Normal(1),
        "nz" => Role::Normal(2),
        "s" | "u" | "texture_u" => Role::Uv(0),
        "t" | "v" | "texture_v" => Role::Uv(1),
        "red" | "r" | "diffuse_red" => Role::Color(0),
        "green" | "g" | "diffuse_green" => Role::Color(1),
        "blue" | "b" | "diffuse_blue" => Role::Color(2),
        "alpha" | "a" | "diffuse_alpha" => Role::Color(3),
        _ => Role::Other,
    }
}

impl Reader {
    fn element(&mut self, element: &Element, values: &mut Values<'_>) -> Result<(), Fault> {
        values.expect(element)?;
        match element.name.as_str() {
            "vertex" => self.vertices(element, values),
            "face" => self.lists(element, values, |reader, place, list| reader.face(place, list)),
            "tristrips" => self.lists(element, values, |reader, _, list| reader.strip(list)),
            other => {
                self.warnings.push(format!("element {other} ({}) is ignored", element.count));
                self.lists(element, values, |_, _, _| Ok(()))
            }
        }
    }

    fn vertices(&mut self, element: &Element, values: &mut Values<'_>) -> Result<(), Fault> {
        if !self.piece.positions.is_empty() {
            return Err(Fault::new("header", "two elements named vertex"));
        }
        if element.count > MAX_VERTICES as u64 {
            return Err(Fault::new(
                "header",
                format!("{} vertices, at most {MAX_VERTICES} are read", element.count),
            ));
        }
        let roles: Vec<Role> = element.properties.iter().map(|property| role(&property.name)).collect();
        let has = |role: Role| roles.contains(&role);
        if !(0..3).all(|axis| has(Role::Position(axis))) {
            return Err(Fault::new("header", "element vertex lacks x, y or z"));
        }
        let (normals, uvs) =
            ((0..3).all(|axis| has(Role::Normal(axis))), (0..2).all(|axis| has(Role::Uv(axis))));
        let colors = (0..3).all(|part| has(Role::Color(part)));
        for number in 0..element.count {
            let place = format_args!("vertex {number}");
            let [mut position, mut normal] = [Vec3::ZERO; 2];
            let (mut uv, mut color) = (Vec2::ZERO, Vec4::ONE);
            for (property, role) in element.properties.iter().zip(&roles) {
                let Kind::Scalar(kind) = property.kind else {
                    values.list(property.kind, place)?;
                    continue;
                };
                let value = values.number(kind, place)? as f32;
                match *role {
                    Role::Position(axis) => position[axis] = value,
                    Role::Normal(axis) => normal[axis] = value,
                    Role::Uv(axis) => uv[axis] = value,
                    Role::Color(part) => color[part] = value / kind.full_scale(),
                    Role::Other => {}
                }
            }
            self.piece.positions.push(position);
            if normals {
                self.piece.normals.push(normal.normalize_or_zero());
            }
            if uvs {
                // (0, 0) is the lower left corner in PLY, the upper left here.
                self.piece.uvs.push(Vec2::new(uv.x, 1.0 - uv.y));
            }
            if colors {
                let linear = color.truncate().map(srgb_to_linear);
                self.piece.colors.push(linear.extend(color.w));
            }
        }
        Ok(())
    }

    /// Reads every item of an element and hands over its list of vertices.
    fn lists(
        &mut self,
        element: &Element,
        values: &mut Values<'_>,
        mut take: impl FnMut(&mut Self, &str, Vec<i64>) -> Result<(), Fault>,
    ) -> Result<(), Fault> {
        if element.properties.is_empty() {
            return Ok(());
        }
        for number in 0..element.count {
            let place = format!("{} {number}", element.name);
            for property in &element.properties {
                match property.kind {
                    Kind::Scalar(kind) => drop(values.number(kind, format_args!("{place}"))?),
                    list => {
                        let items = values.list(list, format_args!("{place}"))?;
                        if matches!(property.name.as_str(), "vertex_indices" | "vertex_index") {
                            take(self, &place, items)?;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn face(&mut self, place: &str, list: Vec<i64>) -> Result<(), Fault> {
        if list.len() < 3 {
            return Err(Fault::new(place, format!("{} corners", list.len())));
        }
        self.corners += list.len();
        if self.corners > 3 * MAX_TRIANGLES {
            return Err(Fault::new(place, format!("more than {MAX_TRIANGLES} triangles")));
        }
        let index = |value: &i64| {
            u32::try_from(*value).map_err(|_| Fault::new(place, format!("{value} is no index of a vertex")))
        };
        self.faces.push(list.iter().map(index).collect::<Result<_, _>>()?);
        Ok(())
    }

    /// One after the other, separated by −1; every second triangle is turned.
    fn strip(&mut self, list: Vec<i64>) -> Result<(), Fault> {
        for (number, strip) in list.split(|&index| index == -1).enumerate() {
            for (i, corners) in strip.windows(3).enumerate() {
                let turned = if i % 2 == 0 { [0, 1, 2] } else { [0, 2, 1] };
                let triangle = turned.map(|corner| u32::try_from(corners[corner]).ok());
                let [Some(a), Some(b), Some(c)] = triangle else {
                    return Err(Fault::new(
                        format!("strip {number}"),
                        format!("{corners:?} are no indices of vertices"),
                    ));
                };
                self.strips.push([a, b, c]);
            }
        }
        Ok(())
    }

    fn finish(mut self, options: &ImportOptions) -> Result<Imported, Fault> {
        self.triangulate()?;
        let mut piece = self.piece;
        piece.positions.iter_mut().for_each(|point| *point = turned(*point, options.up) * options.unit_m);
        piece.normals.iter_mut().for_each(|normal| *normal = turned(*normal, options.up));
        let lacking = piece.normals.is_empty();
        if lacking && options.missing_normals == MissingNormals::Flat {
            piece = flat_shaded(&piece);
        } else {
            piece.normals.resize(piece.positions.len(), Vec3::ZERO);
            let repaired = normals::repair(&mut piece.normals, &piece.positions, &piece.indices);
            if !lacking && repaired > 0 {
                self.warnings.push(format!("{repaired} normals are zero or not finite, smooth ones instead"));
            }
        }
        let mut assembly = Assembly::default();
        assembly.warnings = self.warnings;
        let material = assembly.material(Material::default());
        if !piece.indices.is_empty() {
            assembly.add(piece, material, "faces")?;
        }
        assembly.finish(0)
    }

    fn triangulate(&mut self) -> Result<(), Fault> {
        let vertices = self.piece.positions.len();
        let check = |number: usize, what: &str, indices: &[u32]| match indices
            .iter()
            .find(|&&i| i as usize >= vertices)
        {
            None => Ok(()),
            Some(index) => {
                let problem = format!("index {index}, but there are only {vertices} vertices");
                Err(Fault::new(format!("{what} {number}"), problem))
            }
        };
        for (number, face) in self.faces.iter().enumerate() {
            check(number, "face", face)?;
            let outline: Vec<Vec3> = face.iter().map(|&index| self.piece.positions[index as usize]).collect();
            for triangle in polygon::triangulate(&outline) {
                self.piece.indices.extend(triangle.map(|corner| face[corner]));
            }
        }
        for (number, triangle) in self.strips.iter().enumerate() {
            check(number, "triangle of strips", triangle)?;
            self.piece.indices.extend(triangle);
        }
        Ok(())
    }
}

fn flat_shaded(piece: &Piece) -> Piece {
    let corners = || piece.indices.iter().map(|&index| index as usize);
    let mut flat = Piece {
        positions: corners().map(|corner| piece.positions[corner]).collect(),
        indices: (0..piece.indices.len() as u32).collect(),
        ..Piece::default()
    };
    if !piece.uvs.is_empty() {
        flat.uvs = corners().map(|corner| piece.uvs[corner]).collect();
    }
    if !piece.colors.is_empty() {
        flat.colors = corners().map(|corner| piece.colors[corner]).collect();
    }
    let triangles = flat.positions.chunks_exact(3);
    flat.normals = triangles.flat_map(|corner| [normals::flat(corner[0], corner[1], corner[2]); 3]).collect();
    flat
}
