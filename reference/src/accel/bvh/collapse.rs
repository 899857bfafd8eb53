//! From the binary hierarchy to the four-wide one.

use std::time::Duration;

use glam::{Vec3, Vec3A, Vec4};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::triangle::Triangle;

use super::super::geometry::Geometry;
use super::super::watertight::TrianglePacket;
use super::{Bvh, HAS_ALPHA, LEAF, Leaf, NO_CHILD, Node};

/// Leaves hold up to four triangles, as many as are tested at once, and are worth filling.
const BUILD: BvhBuildParams = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::medium_build() };

pub(super) fn build(geometry: &Geometry, takes: impl Fn(u32) -> bool) -> Bvh {
    let count = geometry.triangle_count();
    let numbers: Vec<u32> = (0..count).filter(|&number| takes(number)).collect();
    let triangles: Vec<Triangle> = numbers.iter().map(|&number| to_obvhs(geometry.corners(number))).collect();
    if triangles.is_empty() {
        return Bvh::default();
    }
    let binary = build_bvh2_from_tris(&triangles, BUILD, &mut Duration::default());
    let mut collapse = Collapse {
        geometry,
        numbers: &numbers,
        binary: &binary,
        bvh: Bvh { extent_m: triangles.iter().map(extent).fold(0.0, f32::max), ..Bvh::default() },
    };
    collapse.run();
    collapse.bvh
}

fn to_obvhs([v0, v1, v2]: [Vec3; 3]) -> Triangle {
    Triangle { v0: v0.into(), v1: v1.into(), v2: v2.into() }
}

fn extent(triangle: &Triangle) -> f32 {
    let largest = |v: Vec3A| v.abs().max_element();
    largest(triangle.v0).max(largest(triangle.v1)).max(largest(triangle.v2))
}

struct Collapse<'a> {
    geometry: &'a Geometry,
    numbers: &'a [u32],
    binary: &'a Bvh2,
    bvh: Bvh,
}

impl<'a> Collapse<'a> {
    /// Node by node; a child's number is known before its own children are.
    fn run(&mut self) {
        let binary = self.binary;
        let mut waiting: Vec<(&Bvh2Node, usize)> = Vec::new();
        if let Some(root) = binary.nodes.first() {
            self.bvh.nodes.push(EMPTY_NODE);
            waiting.push((root, 0));
        }
        while let Some((node, at)) = waiting.pop() {
            for (lane, child) in four_children(binary, node).into_iter().enumerate() {
                let number = if child.is_leaf() {
                    self.push_leaf(child)
                } else {
                    let number = self.bvh.nodes.len();
                    self.bvh.nodes.push(EMPTY_NODE);
                    waiting.push((child, number));
                    number as u32
                };
                set_child(&mut self.bvh.nodes[at], lane, child, number);
            }
        }
    }

    fn push_leaf(&mut self, leaf: &Bvh2Node) -> u32 {
        let first = leaf.first_index as usize;
        let indices = &self.binary.primitive_indices[first..first + leaf.prim_count as usize];
        debug_assert!(indices.len() <= 4, "the builder was told to make leaves of four");
        let numbers: Vec<u32> = indices.iter().map(|&index| self.numbers[index as usize]).collect();
        let corners: Vec<[Vec3; 3]> = numbers.iter().map(|&number| self.geometry.corners(number)).collect();
        self.bvh.leaves.push(Leaf {
            triangles: TrianglePacket::new(&corners),
            number: std::array::from_fn(|lane| {
                let number = numbers.get(lane).copied().unwrap_or(0);
                if self.geometry.alpha_decides(number) { number | HAS_ALPHA } else { number }
            }),
        });
        (self.bvh.leaves.len() - 1) as u32 | LEAF
    }
}

/// A node's children, the one of the largest area opened until there are four. A root that is a leaf is its own child.
fn four_children<'b>(binary: &'b Bvh2, node: &'b Bvh2Node) -> Vec<&'b Bvh2Node> {
    let children_of = |node: &Bvh2Node| {
        let first = node.first_index as usize;
        binary.nodes[first..first + 2].iter()
    };
    if node.is_leaf() {
        return vec![node];
    }
    let mut children: Vec<&Bvh2Node> = children_of(node).collect();
    while children.len() < 4 {
        let inner = children.iter().enumerate().filter(|(_, child)| !child.is_leaf());
        let area = |child: &Bvh2Node| child.aabb().half_area();
        let Some((at, _)) = inner.max_by(|a, b| area(a.1).total_cmp(&area(b.1))) else {
            break;
        };
        let opened = children.swap_remove(at);
        children.extend(children_of(opened));
    }
    children
}

/// Boxes that are inside out: entered at infinity, from wherever. Should a ray of absurd numbers enter one, it finds no
/// leaf.
const EMPTY_NODE: Node = Node { plane: [[Vec4::INFINITY, Vec4::NEG_INFINITY]; 3], child: [NO_CHILD; 4] };

fn set_child(node: &mut Node, lane: usize, child: &Bvh2Node, number: u32) {
    let bounds = child.aabb();
    for axis in 0..3 {
        node.plane[axis][0][lane] = bounds.min[axis];
        node.plane[axis][1][lane] = bounds.max[axis];
    }
    node.child[lane] = number;
}
