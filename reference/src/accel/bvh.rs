//! A four-wide bounding volume hierarchy.
//!
//! `obvhs` builds a binary hierarchy (PLOC with reinsertion); it is collapsed so that a node's four boxes, and a leaf's
//! four triangles, are tested at once. Boxes are conservative: each ray widens them by a bound on all rounding errors of
//! the box test *and* of the triangle test, so that no box is missed whose triangle would be hit. `obvhs`' own traversals
//! do without: they lose rays that graze a box, and the wide one all hits closer than 0.1 mm.

mod collapse;

use glam::{Vec3, Vec4};

use super::geometry::Geometry;
use super::ray::{Hit, Ray};
use super::watertight::{ShearedRay, TrianglePacket};

/// Triangle numbers carry this bit where a texture decides whether the surface is there.
const HAS_ALPHA: u32 = 1 << 31;
/// Children carry this bit where they are leaves.
const LEAF: u32 = 1 << 31;
/// A leaf that is not there.
const NO_CHILD: u32 = u32::MAX;

/// Boxes of up to four children; unused ones are inside out.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// `plane[axis][side]`, side 0 the lower.
    plane: [[Vec4; 2]; 3],
    /// Numbers of nodes, or of leaves with the bit [`LEAF`].
    child: [u32; 4],
}

/// Up to four triangles.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    triangles: TrianglePacket,
    number: [u32; 4],
}

/// The hierarchy.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    /// Largest absolute coordinate, for the error bound.
    extent_m: f32,
}

/// A ray as the box test wants it.
struct SlabRay {
    /// The origin moved towards the near and the far planes by the error bound: `[near, far][axis]`.
    origin: [[Vec4; 3]; 2],
    inverse: [Vec4; 3],
    /// Which plane of each axis is near.
    near: [usize; 3],
}

impl Bvh {
    /// Over the triangles that `takes` picks.
    pub fn build(geometry: &Geometry, takes: impl Fn(u32) -> bool) -> Self {
        collapse::build(geometry, takes)
    }

    /// The nearest hit within (t_min, t_max). `accept` is asked about triangles whose alpha decides.
    pub fn closest(&self, ray: &Ray, accept: impl Fn(u32, Vec3) -> bool) -> Option<Hit> {
        self.cast::<false>(ray, accept)
    }

    /// True if there is any hit within (t_min, t_max).
    pub fn occluded(&self, ray: &Ray, accept: impl Fn(u32, Vec3) -> bool) -> bool {
        self.cast::<true>(ray, accept).is_some()
    }

    fn cast<const ANY: bool>(&self, ray: &Ray, accept: impl Fn(u32, Vec3) -> bool) -> Option<Hit> {
        let root = self.nodes.first()?;
        let slab = SlabRay::new(ray, self.extent_m);
        // Most rays of a picture miss a small scene: they shall not pay for more than this.
        if root.intersect(&slab, ray.t_min, ray.t_max).1 == 0 {
            return None;
        }
        // One traversal for each main axis, so that the triangle test knows its axes at compile time.
        let sheared = ShearedRay::new(ray);
        match sheared.main_axis() {
            0 => self.traverse::<ANY, 0>(ray, &slab, &sheared, accept),
            1 => self.traverse::<ANY, 1>(ray, &slab, &sheared, accept),
            _ => self.traverse::<ANY, 2>(ray, &slab, &sheared, accept),
        }
    }

    fn traverse<const ANY: bool, const Z: usize>(
        &self,
        ray: &Ray,
        slab: &SlabRay,
        sheared: &ShearedRay,
        accept: impl Fn(u32, Vec3) -> bool,
    ) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut t_max = ray.t_max;
        let mut stack = Stack::new();
        let mut next = Some(0);
        while let Some(child) = next {
            if child & LEAF == 0 {
                let node = self.nodes.get(child as usize)?;
                next = stack.descend::<ANY>(node, slab, ray.t_min, t_max);
                continue;
            }
            let Some(leaf) = self.leaves.get((child & !LEAF) as usize) else {
                next = stack.pop(t_max);
                continue;
            };
            if let Some(hit) = leaf.intersect::<ANY, Z>(sheared, ray.t_min, t_max, &accept) {
                if ANY {
                    return Some(hit);
                }
                t_max = hit.t;
                best = Some(hit);
            }
            next = stack.pop(t_max);
        }
        best
    }
}

impl Node {
    /// Entry distances of the four boxes, and which of them are hit.
    #[inline(always)]
    fn intersect(&self, ray: &SlabRay, t_min: f32, t_max: f32) -> (Vec4, u32) {
        let near =
            |axis: usize| (self.plane[axis][ray.near[axis] & 1] - ray.origin[0][axis]) * ray.inverse[axis];
        let far = |axis: usize| {
            (self.plane[axis][(ray.near[axis] ^ 1) & 1] - ray.origin[1][axis]) * ray.inverse[axis]
        };
        let enter = near(0).max(near(1)).max(near(2)).max(Vec4::splat(t_min));
        let leave = far(0).min(far(1)).min(far(2)).min(Vec4::splat(t_max));
        (enter, enter.cmple(leave).bitmask())
    }
}

impl Leaf {
    #[inline(always)]
    fn intersect<const ANY: bool, const Z: usize>(
        &self,
        ray: &ShearedRay,
        t_min: f32,
        t_max: f32,
        accept: &impl Fn(u32, Vec3) -> bool,
    ) -> Option<Hit> {
        let packet = self.triangles.intersect::<Z>(ray, t_min, t_max);
        let mut mask = packet.mask;
        let mut best: Option<Hit> = None;
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 3;
            mask &= mask - 1;
            let t = packet.t[lane];
            if best.is_some_and(|best| best.t <= t) {
                continue;
            }
            let number = self.number[lane];
            let [u, v, w] = packet.barycentric;
            let hit =
                Hit { t, triangle: number & !HAS_ALPHA, barycentric: Vec3::new(u[lane], v[lane], w[lane]) };
            if number & HAS_ALPHA == 0 || accept(hit.triangle, hit.barycentric) {
                best = Some(hit);
                if ANY {
                    break;
                }
            }
        }
        best
    }
}

impl SlabRay {
    fn new(ray: &Ray, extent_m: f32) -> Self {
        /// 1/TINY and its products with coordinates stay finite; t · TINY is far below any error bound.
        const TINY: f32 = 1e-24;
        // Each corner's coordinates in the frame of the triangle test are off by less than eight roundings of |o| + |v|,
        // a plane's distance in the box test by less than four; ε is two roundings.
        let bound = 8.0 * f32::EPSILON * (ray.origin.abs().max_element() + extent_m);
        let tiny = Vec3::splat(TINY).copysign(ray.direction);
        let direction = Vec3::select(ray.direction.abs().cmplt(Vec3::splat(TINY)), tiny, ray.direction);
        let bound = Vec3::splat(bound).copysign(direction);
        let lanes = |v: Vec3| v.to_array().map(Vec4::splat);
        Self {
            origin: [lanes(ray.origin + bound), lanes(ray.origin - bound)],
            inverse: lanes(direction.recip()),
            near: direction.to_array().map(|part| usize::from(part < 0.0)),
        }
    }
}

/// Children that wait, the nearest on top.
struct Stack {
    entries: [(u32, f32); Stack::FIXED],
    length: usize,
    /// Only hierarchies of pathological depth get here.
    overflow: Vec<(u32, f32)>,
}

impl Stack {
    const FIXED: usize = 48;

    fn new() -> Self {
        Self { entries: [(0, 0.0); Self::FIXED], length: 0, overflow: Vec::new() }
    }

    #[inline(always)]
    fn push(&mut self, child: u32, enter: f32) {
        match self.entries.get_mut(self.length) {
            Some(entry) => {
                *entry = (child, enter);
                self.length += 1;
            }
            None => self.overflow.push((child, enter)),
        }
    }

    /// The next child that is entered before `t_max`.
    #[inline(always)]
    fn pop(&mut self, t_max: f32) -> Option<u32> {
        loop {
            let entry = match self.overflow.pop() {
                Some(entry) => entry,
                None => {
                    self.length = self.length.checked_sub(1)?;
                    *self.entries.get(self.length)?
                }
            };
            if entry.1 <= t_max {
                return Some(entry.0);
            }
        }
    }

    /// Goes on with the nearest child of a node, and leaves the others for later.
    #[inline(always)]
    fn descend<const ANY: bool>(
        &mut self,
        node: &Node,
        ray: &SlabRay,
        t_min: f32,
        t_max: f32,
    ) -> Option<u32> {
        let (enter, mut mask) = node.intersect(ray, t_min, t_max);
        if mask == 0 {
            return self.pop(t_max);
        }
        let lane = mask.trailing_zeros() as usize & 3;
        mask &= mask - 1;
        let mut nearest = (node.child[lane], enter[lane]);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize & 3;
            mask &= mask - 1;
            let mut other = (node.child[lane], enter[lane]);
            if !ANY && other.1 < nearest.1 {
                std::mem::swap(&mut nearest, &mut other);
            }
            self.push(other.0, other.1);
        }
        Some(nearest.0)
    }
}
