//! Meshes from grids of vertices.

use glam::{Vec2, Vec3};

use crate::mesh::{Mesh, Part};

/// A corner of a grid.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub position: Vec3,
    pub normal: Vec3,
    pub uv: Vec2,
}

/// Collects grids and fans into one mesh with one part.
#[derive(Default)]
pub(super) struct Builder {
    mesh: Mesh,
}

impl Builder {
    /// `columns × rows` quads from `(columns + 1) × (rows + 1)` vertices. The front is where
    /// `∂position/∂column × ∂position/∂row` points to. Triangles of a collapsed edge (a pole) are left out.
    pub fn grid(&mut self, columns: u32, rows: u32, vertex: impl Fn(u32, u32) -> Vertex) {
        let first = self.mesh.positions.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                self.vertex(vertex(column, row));
            }
        }
        let at = |column, row| first + row * (columns + 1) + column;
        for row in 0..rows {
            for column in 0..columns {
                let [a, b] = [at(column, row), at(column + 1, row)];
                let [d, c] = [at(column, row + 1), at(column + 1, row + 1)];
                self.triangle(a, b, c);
                self.triangle(a, c, d);
            }
        }
    }

    /// A flat lid over a loop of positions, counter-clockwise seen from where `normal` points to.
    pub fn fan(&mut self, rim: &[Vec3], normal: Vec3) {
        let center = rim.iter().sum::<Vec3>() / rim.len() as f32;
        let middle = Vec2::splat(0.5);
        let first = self.vertex(Vertex { position: center, normal, uv: middle });
        for (i, &position) in rim.iter().enumerate() {
            let angle = i as f32 / rim.len() as f32 * std::f32::consts::TAU;
            let uv = middle + Vec2::new(angle.cos(), -angle.sin()) / 2.0;
            self.vertex(Vertex { position, normal, uv });
        }
        let count = rim.len() as u32;
        for i in 0..count {
            self.triangle(first, first + 1 + i, first + 1 + (i + 1) % count);
        }
    }

    /// The mesh.
    pub fn finish(mut self, name: &str) -> Mesh {
        name.clone_into(&mut self.mesh.name);
        let triangles = self.mesh.triangle_count() as u32;
        self.mesh.parts = vec![Part { triangles: 0..triangles, material: 0 }];
        self.mesh
    }

    fn vertex(&mut self, vertex: Vertex) -> u32 {
        let index = self.mesh.positions.len() as u32;
        // −0 becomes +0, so that points on both sides of a seam are the same bits.
        self.mesh.positions.push(vertex.position + Vec3::ZERO);
        self.mesh.normals.push(vertex.normal + Vec3::ZERO);
        self.mesh.uvs.push(vertex.uv);
        index
    }

    fn triangle(&mut self, a: u32, b: u32, c: u32) {
        let [pa, pb, pc] = [a, b, c].map(|index| self.mesh.positions[index as usize]);
        if pa != pb && pb != pc && pc != pa {
            self.mesh.indices.extend([a, b, c]);
        }
    }
}

/// Cosine and sine of `step/steps` of a full turn; exact at quarter turns, and the same bits after a whole turn.
pub(super) fn cos_sin_of_turn(step: u32, steps: u32) -> (f64, f64) {
    let step = step % steps;
    if (4 * u64::from(step)).is_multiple_of(u64::from(steps)) {
        return match 4 * u64::from(step) / u64::from(steps) {
            0 => (1.0, 0.0),
            1 => (0.0, 1.0),
            2 => (-1.0, 0.0),
            _ => (0.0, -1.0),
        };
    }
    let (sin, cos) = (std::f64::consts::TAU * f64::from(step) / f64::from(steps)).sin_cos();
    (cos, sin)
}
