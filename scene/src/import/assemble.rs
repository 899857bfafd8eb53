//! One mesh from many pieces.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};

use super::error::Fault;
use super::{Imported, MAX_TRIANGLES, MAX_VERTICES, Statistics};
use crate::material::Material;
use crate::mesh::{Mesh, MeshError, Part};
use crate::tangents;

/// Triangles of one material. Attributes are as long as `positions`, or empty; normals are never empty.
#[derive(Default)]
pub(super) struct Piece {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    pub tangents: Vec<Vec4>,
    pub colors: Vec<Vec4>,
    pub indices: Vec<u32>,
}

/// Pieces so far, as one mesh.
#[derive(Default)]
pub(super) struct Assembly {
    mesh: Mesh,
    materials: Vec<Arc<Material>>,
    pub warnings: Vec<String>,
}

impl Assembly {
    /// Takes a new material and gives its slot.
    pub fn material(&mut self, material: Material) -> usize {
        self.materials.push(Arc::new(material));
        self.materials.len() - 1
    }

    /// Before pieces are unpacked: whether so many more fit.
    pub fn reserve(&self, vertices: usize, triangles: usize, place: &str) -> Result<(), Fault> {
        let check = |what, have: usize, more: usize, most| match have.checked_add(more) {
            Some(sum) if sum <= most => Ok(()),
            _ => Err(Fault::new(place, format!("{more} {what} after {have}: more than {most} together"))),
        };
        check("vertices", self.mesh.positions.len(), vertices, MAX_VERTICES)?;
        check("triangles", self.mesh.triangle_count(), triangles, MAX_TRIANGLES)
    }

    /// Appends a piece as a part of its own.
    pub fn add(&mut self, piece: Piece, material: usize, place: &str) -> Result<(), Fault> {
        let vertices = piece.positions.len();
        self.reserve(vertices, piece.indices.len() / 3, place)?;
        if let Some(&index) = piece.indices.iter().find(|&&index| index as usize >= vertices) {
            return Err(Fault::new(place, format!("index {index}, but there are only {vertices} vertices")));
        }
        let first = self.mesh.positions.len();
        let first_triangle = self.mesh.triangle_count() as u32;
        self.mesh.indices.extend(piece.indices.iter().map(|index| index + first as u32));
        append(&mut self.mesh.uvs, piece.uvs, first, vertices, Vec2::ZERO);
        append(&mut self.mesh.colors, piece.colors, first, vertices, Vec4::ONE);
        append(&mut self.mesh.tangents, piece.tangents, first, vertices, Vec4::ZERO);
        self.mesh.positions.extend(piece.positions);
        self.mesh.normals.extend(piece.normals);
        let triangles = first_triangle..self.mesh.triangle_count() as u32;
        self.mesh.parts.push(Part { triangles, material });
        Ok(())
    }

    /// The mesh with its materials; tangents only where a normal map needs them.
    pub fn finish(mut self, images: usize) -> Result<Imported, Fault> {
        if self.mesh.indices.is_empty() {
            return Err(Fault::new("whole file", "no triangles"));
        }
        let unsound = |error: MeshError| Fault::new("whole file", error.to_string());
        if self.materials.iter().any(|material| material.normal_map.is_some()) {
            tangents::complete(&mut self.mesh).map_err(unsound)?;
        } else {
            self.mesh.tangents.clear();
        }
        self.mesh.check().map_err(unsound)?;
        let statistics = Statistics {
            vertices: self.mesh.positions.len(),
            triangles: self.mesh.triangle_count(),
            parts: self.mesh.parts.len(),
            materials: self.materials.len(),
            images,
        };
        let mesh = Arc::new(self.mesh);
        Ok(Imported { mesh, materials: self.materials, warnings: self.warnings, statistics })
    }
}

/// Where only some pieces have an attribute, the others get a neutral value.
fn append<T: Copy>(all: &mut Vec<T>, piece: Vec<T>, first: usize, count: usize, neutral: T) {
    if piece.is_empty() && all.is_empty() {
        return;
    }
    all.resize(first, neutral);
    all.extend(piece);
    all.resize(first + count, neutral);
}
