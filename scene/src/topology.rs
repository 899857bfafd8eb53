//! Which triangles hang together.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::mesh::Mesh;

/// How a surface hangs together once corners at the same place are taken for one. Triangles that then have two equal
/// corners are left out; so are those with missing or non-finite corners.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// Different corner positions in use.
    pub vertices: usize,
    /// Different edges.
    pub edges: usize,
    /// Triangles counted.
    pub faces: usize,
    /// Edges of exactly one triangle, by their ends.
    pub open_edges: Vec<[Vec3; 2]>,
    /// Edges of more than two triangles.
    pub non_manifold_edges: Vec<[Vec3; 2]>,
    /// Edges of two triangles that wind in opposite senses.
    pub flipped_edges: Vec<[Vec3; 2]>,
    /// Pieces connected by edges; two that touch in a point only are two.
    pub components: Vec<Component>,
}

/// A piece of surface.
#[derive(Clone, Copy, Debug)]
pub struct Component {
    /// Number of triangles.
    pub faces: usize,
    /// Signed volume, m³; positive where the surface is closed and winds outward.
    pub volume_m3: f64,
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Topology {
    /// Of all triangles of a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        let triangles = u32::try_from(mesh.triangle_count()).unwrap_or(u32::MAX);
        Self::of_triangles(mesh, std::iter::once(0..triangles))
    }

    /// Of some ranges of triangles.
    pub fn of_triangles(mesh: &Mesh, ranges: impl IntoIterator<Item = Range<u32>>) -> Self {
        let mut welded = Welded::default();
        for range in ranges {
            for triangle in range {
                if let Some(corners) = corners(mesh, triangle) {
                    welded.add(corners);
                }
            }
        }
        welded.topology()
    }

    /// Vertices − edges + faces: 2 for each closed piece without handles, 0 for a torus.
    pub fn euler_characteristic(&self) -> i64 {
        self.vertices as i64 - self.edges as i64 + self.faces as i64
    }

    /// Each edge belongs to exactly two triangles that wind alike.
    pub fn is_closed(&self) -> bool {
        let faults = self.open_edges.len() + self.non_manifold_edges.len() + self.flipped_edges.len();
        self.faces > 0 && faults == 0
    }
}

fn corners(mesh: &Mesh, triangle: u32) -> Option<[Vec3; 3]> {
    let [a, b, c] = mesh.triangle(triangle as usize)?;
    let at = |index: u32| mesh.positions.get(index as usize).copied().filter(|point| point.is_finite());
    Some([at(a)?, at(b)?, at(c)?])
}

#[derive(Default)]
struct Welded {
    number: HashMap<[u32; 3], u32>,
    points: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
}

impl Welded {
    fn add(&mut self, corners: [Vec3; 3]) {
        let face = corners.map(|point| self.weld(point));
        if face[0] != face[1] && face[1] != face[2] && face[2] != face[0] {
            self.faces.push(face);
        }
    }

    fn weld(&mut self, point: Vec3) -> u32 {
        // Adding +0 turns −0 into +0.
        let key = (point + Vec3::ZERO).to_array().map(f32::to_bits);
        *self.number.entry(key).or_insert_with(|| {
            self.points.push(point);
            self.points.len() as u32 - 1
        })
    }

    fn topology(self) -> Topology {
        let mut topology = Topology { faces: self.faces.len(), ..Topology::default() };
        let mut used = vec![false; self.points.len()];
        self.faces.iter().flatten().for_each(|&corner| used[corner as usize] = true);
        topology.vertices = used.iter().filter(|&&used| used).count();
        let mut pieces = DisjointSets::new(self.faces.len());
        for same in self.edges().chunk_by(|a, b| a.ends == b.ends) {
            self.count_edge(same, &mut topology);
            same.windows(2).for_each(|pair| pieces.join(pair[0].face, pair[1].face));
        }
        topology.components = self.components(pieces);
        topology
    }

    /// Every side of every face, equal ones side by side.
    fn edges(&self) -> Vec<Edge> {
        let mut edges = Vec::with_capacity(self.faces.len() * 3);
        for (face, &[a, b, c]) in self.faces.iter().enumerate() {
            edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| Edge {
                ends: [from.min(to), from.max(to)],
                rising: from < to,
                face: face as u32,
            }));
        }
        edges.sort_unstable();
        edges
    }

    fn count_edge(&self, same: &[Edge], topology: &mut Topology) {
        topology.edges += 1;
        let ends = same[0].ends.map(|vertex| self.points[vertex as usize]);
        match same {
            [_] => topology.open_edges.push(ends),
            [one, other] if one.rising == other.rising => topology.flipped_edges.push(ends),
            [_, _] => {}
            _ => topology.non_manifold_edges.push(ends),
        }
    }

    fn components(&self, mut pieces: DisjointSets) -> Vec<Component> {
        let mut slot: HashMap<u32, usize> = HashMap::new();
        let mut components: Vec<Component> = Vec::new();
        for (number, face) in self.faces.iter().enumerate() {
            let [a, b, c] = face.map(|vertex| self.points[vertex as usize]);
            let number = *slot.entry(pieces.find(number as u32)).or_insert_with(|| {
                components.push(Component { faces: 0, volume_m3: 0.0, min: a, max: a });
                components.len() - 1
            });
            let component = &mut components[number];
            component.faces += 1;
            component.volume_m3 += signed_volume(a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
            component.min = component.min.min(a).min(b).min(c);
            component.max = component.max.max(a).max(b).max(c);
        }
        components
    }
}

/// A side of a face.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [u32; 2],
    rising: bool,
    face: u32,
}

fn signed_volume(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    a.dot(b.cross(c)) / 6.0
}

/// Union–find with path halving.
struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    fn find(&mut self, mut member: u32) -> u32 {
        while self.parent[member as usize] != member {
            let grandparent = self.parent[self.parent[member as usize] as usize];
            self.parent[member as usize] = grandparent;
            member = grandparent;
        }
        member
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
