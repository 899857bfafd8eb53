//! Triangles.

use std::ops::Range;

use glam::{Vec2, Vec3, Vec4};
use thiserror::Error;

use crate::bounds::{Aabb, Sphere};

/// A run of triangles of one material.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Range of *triangles*: triangle t has the indices `3t, 3t + 1, 3t + 2`.
    pub triangles: Range<u32>,
    /// Slot in the thing's list of materials.
    pub material: usize,
}

/// An indexed triangle mesh: plain data, right-handed, metres unless a thing's pose scales it.
///
/// Front faces wind counter-clockwise, normals are unit length and on the front side. Attributes are as long as
/// `positions`, or empty where the mesh has none (normals are never empty in a mesh of this crate's making).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// For messages.
    pub name: String,
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Unit shading normals.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, (0, 0) at the upper left of the picture; or empty.
    pub uvs: Vec<Vec2>,
    /// xyz the unit tangent (direction of +u), w = ±1 so that the bitangent is `w · (n × t)`; or empty.
    pub tangents: Vec<Vec4>,
    /// Linear RGBA, multiplies the base colour; or empty.
    pub colors: Vec<Vec4>,
    /// Three for each triangle.
    pub indices: Vec<u32>,
    /// Cover all triangles, in order, without gaps.
    pub parts: Vec<Part>,
}

/// Why data are no mesh. Places are given as they stand in the mesh.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MeshError {
    /// An attribute has another length than the positions.
    #[error("mesh '{mesh}': {attribute} has {found} entries, but there are {expected} positions")]
    AttributeLength {
        /// Name of the mesh.
        mesh: String,
        /// Name of the attribute.
        attribute: &'static str,
        /// Its length.
        found: usize,
        /// Number of positions.
        expected: usize,
    },
    /// More corners than u32 can count, or indices that are no whole triangles.
    #[error("mesh '{mesh}': {count} {what}")]
    Count {
        /// Name of the mesh.
        mesh: String,
        /// The number.
        count: usize,
        /// Of what, and why not.
        what: &'static str,
    },
    /// An index points behind the last corner.
    #[error(
        "mesh '{mesh}': index {index} of triangle {triangle} is out of range, there are {vertices} vertices"
    )]
    IndexRange {
        /// Name of the mesh.
        mesh: String,
        /// Number of the triangle.
        triangle: usize,
        /// The index.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// Parts do not cover the triangles one after the other.
    #[error(
        "mesh '{mesh}': part {part} covers triangles {found:?}, expected it to start at {expected} and to stay below {triangles}"
    )]
    Parts {
        /// Name of the mesh.
        mesh: String,
        /// Number of the part.
        part: usize,
        /// Its range.
        found: Range<u32>,
        /// Where it should start.
        expected: u32,
        /// Number of triangles.
        triangles: u32,
    },
}

impl Mesh {
    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// Number of material slots its parts use.
    pub fn material_slots(&self) -> usize {
        self.parts.iter().map(|part| part.material + 1).max().unwrap_or(0)
    }

    /// Indices of the corners of a triangle, or `None` behind the last.
    #[inline]
    pub fn triangle(&self, triangle: usize) -> Option<[u32; 3]> {
        let first = triangle.checked_mul(3)?;
        self.indices.get(first..first + 3)?.try_into().ok()
    }

    /// Index triples of all triangles.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = [u32; 3]> + '_ {
        self.indices.chunks_exact(3).map(|corner| [corner[0], corner[1], corner[2]])
    }

    /// Corner positions of all triangles. A mesh that fails [`Mesh::check`] yields NaN for missing corners.
    pub fn triangle_positions(&self) -> impl ExactSizeIterator<Item = [Vec3; 3]> + '_ {
        let at = |index: u32| self.positions.get(index as usize).copied().unwrap_or(Vec3::NAN);
        self.triangles().map(move |corners| corners.map(at))
    }

    /// The part a triangle belongs to.
    pub fn part_of(&self, triangle: u32) -> Option<usize> {
        let part = self.parts.partition_point(|part| part.triangles.end <= triangle);
        (part < self.parts.len()).then_some(part)
    }

    /// Sum of all triangle areas, m², summed in f64.
    pub fn area_m2(&self) -> f64 {
        self.triangle_positions().map(|[a, b, c]| triangle_area_m2(a, b, c)).sum()
    }

    /// Enclosed volume, m³: positive for a closed mesh that winds outward; meaningless for an open one.
    pub fn volume_m3(&self) -> f64 {
        let signed = |[a, b, c]: [Vec3; 3]| a.as_dvec3().dot(b.as_dvec3().cross(c.as_dvec3())) / 6.0;
        self.triangle_positions().map(signed).sum()
    }

    /// Smallest box around all positions; `None` without any.
    pub fn aabb(&self) -> Option<Aabb> {
        Aabb::around(self.positions.iter().copied())
    }

    /// A sphere around all positions, close to the smallest; `None` without any.
    pub fn bounding_sphere(&self) -> Option<Sphere> {
        Sphere::around(&self.positions)
    }

    /// Structure only: lengths, index ranges, parts. Geometry is judged by [`crate::validity`].
    pub fn check(&self) -> Result<(), MeshError> {
        self.check_counts()?;
        self.check_attribute("normals", self.normals.len())?;
        self.check_attribute("uvs", self.uvs.len())?;
        self.check_attribute("tangents", self.tangents.len())?;
        self.check_attribute("colors", self.colors.len())?;
        self.check_indices()?;
        self.check_parts()
    }

    fn check_counts(&self) -> Result<(), MeshError> {
        let count = |count, what| Err(MeshError::Count { mesh: self.name.clone(), count, what });
        if u32::try_from(self.positions.len()).is_err() {
            return count(self.positions.len(), "positions, more than 32-bit indices can address");
        }
        if u32::try_from(self.indices.len()).is_err() {
            return count(self.indices.len(), "indices, more than 32 bits can count");
        }
        if !self.indices.len().is_multiple_of(3) {
            return count(self.indices.len(), "indices, not a multiple of three");
        }
        Ok(())
    }

    fn check_attribute(&self, attribute: &'static str, found: usize) -> Result<(), MeshError> {
        let expected = self.positions.len();
        if found == 0 || found == expected {
            return Ok(());
        }
        Err(MeshError::AttributeLength { mesh: self.name.clone(), attribute, found, expected })
    }

    fn check_indices(&self) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        match self.indices.iter().position(|&index| index as usize >= vertices) {
            None => Ok(()),
            Some(at) => Err(MeshError::IndexRange {
                mesh: self.name.clone(),
                triangle: at / 3,
                index: self.indices[at],
                vertices,
            }),
        }
    }

    fn check_parts(&self) -> Result<(), MeshError> {
        let triangles = self.triangle_count() as u32;
        let wrong = |part, found: Range<u32>, expected| {
            Err(MeshError::Parts { mesh: self.name.clone(), part, found, expected, triangles })
        };
        let mut expected = 0;
        for (number, part) in self.parts.iter().enumerate() {
            let Range { start, end } = part.triangles;
            if start != expected || end < start || end > triangles {
                return wrong(number, part.triangles.clone(), expected);
            }
            expected = end;
        }
        if expected != triangles {
            return wrong(self.parts.len(), triangles..triangles, expected);
        }
        Ok(())
    }
}

/// Area of a triangle, m², in f64.
pub fn triangle_area_m2(a: Vec3, b: Vec3, c: Vec3) -> f64 {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    (b - a).cross(c - a).length() / 2.0
}
