//! The watertight ray–triangle test of S. Woop, C. Benthin and I. Wald, *Watertight Ray/Triangle Intersection*, JCGT
//! 2(1), 2013, on four triangles at once.
//!
//! The corners are moved into a frame in which the ray starts at the origin and runs along z. Each corner gets the same
//! rounding in all triangles around it, so the projected triangles still share their edges; and the sign of an edge
//! function, a difference of two products, is right whenever it is not zero, because rounding keeps the order of the
//! products. Zeros are decided in f64, where the products are exact. So a ray that crosses a closed surface meets at
//! least one triangle. (Möller and Trumbore's test rounds each triangle's edges differently, and leaks.)

use glam::{BVec4A, Vec3, Vec4};

use super::ray::Ray;

/// Four triangles: coordinates `corner[i][axis]`, one lane for each triangle.
#[derive(Clone, Copy, Debug)]
pub struct TrianglePacket {
    corner: [[Vec4; 3]; 3],
}

/// A ray as the test wants it.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    main_axis: usize,
    origin: [Vec4; 3],
    shear: [Vec4; 3],
}

/// What the four lanes say. Lanes that miss hold anything.
#[derive(Clone, Copy, Debug)]
pub struct PacketHit {
    /// Bit i: lane i is hit within (t_min, t_max).
    pub mask: u32,
    /// Distances in units of the ray's direction.
    pub t: Vec4,
    /// Weights of the corners.
    pub barycentric: [Vec4; 3],
}

impl TrianglePacket {
    /// Up to four triangles; missing ones are never hit.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let coordinate = |corner: usize, axis: usize| {
            Vec4::from_array(std::array::from_fn(|lane| {
                triangles.get(lane).map_or(f32::NAN, |triangle| triangle[corner][axis])
            }))
        };
        Self { corner: std::array::from_fn(|corner| std::array::from_fn(|axis| coordinate(corner, axis))) }
    }

    /// Tests all four. `Z` is the ray's [`ShearedRay::main_axis`].
    #[inline(always)]
    pub fn intersect<const Z: usize>(&self, ray: &ShearedRay, t_min: f32, t_max: f32) -> PacketHit {
        let [a, b, c] = self.corner.each_ref().map(|corner| ray.to_ray_frame::<Z>(corner));
        let mut u = c[0] * b[1] - c[1] * b[0];
        let mut v = a[0] * c[1] - a[1] * c[0];
        let mut w = b[0] * a[1] - b[1] * a[0];
        if (u.cmpeq(Vec4::ZERO) | v.cmpeq(Vec4::ZERO) | w.cmpeq(Vec4::ZERO)).any() {
            u = exact_difference(c[0], b[1], c[1], b[0]);
            v = exact_difference(a[0], c[1], a[1], c[0]);
            w = exact_difference(b[0], a[1], b[1], a[0]);
        }
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        let determinant = u + v + w;
        let inside: BVec4A = least.cmpge(Vec4::ZERO) | most.cmple(Vec4::ZERO);
        let inside = inside & determinant.cmpne(Vec4::ZERO);
        let mask = inside.bitmask();
        if mask == 0 {
            return PacketHit { mask, t: Vec4::ZERO, barycentric: [Vec4::ZERO; 3] };
        }
        let reciprocal = determinant.recip();
        let t = (u * a[2] + v * b[2] + w * c[2]) * reciprocal;
        let within = t.cmpgt(Vec4::splat(t_min)) & t.cmplt(Vec4::splat(t_max));
        PacketHit {
            mask: mask & within.bitmask(),
            t,
            barycentric: [u * reciprocal, v * reciprocal, w * reciprocal],
        }
    }
}

impl ShearedRay {
    /// Picks the axes: z along the largest part of the direction.
    pub fn new(ray: &Ray) -> Self {
        let direction = ray.direction;
        let size = direction.abs();
        let z = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let along = direction[z];
        Self {
            main_axis: z,
            origin: [x, y, z].map(|axis| Vec4::splat(ray.origin[axis])),
            shear: [direction[x] / along, direction[y] / along, 1.0 / along].map(Vec4::splat),
        }
    }

    /// The axis along which the direction is largest.
    pub fn main_axis(&self) -> usize {
        self.main_axis
    }

    #[inline(always)]
    fn to_ray_frame<const Z: usize>(self, corner: &[Vec4; 3]) -> [Vec4; 3] {
        let depth = corner[Z] - self.origin[2];
        [
            corner[(Z + 1) % 3] - self.origin[0] - self.shear[0] * depth,
            corner[(Z + 2) % 3] - self.origin[1] - self.shear[1] * depth,
            depth * self.shear[2],
        ]
    }
}

/// `a·b − c·d`, rounded once: the products of f32 are exact in f64.
#[cold]
fn exact_difference(a: Vec4, b: Vec4, c: Vec4, d: Vec4) -> Vec4 {
    let product = |a: f32, b: f32| f64::from(a) * f64::from(b);
    Vec4::from_array(std::array::from_fn(|lane| {
        let difference = product(a[lane], b[lane]) - product(c[lane], d[lane]);
        // A difference too small for f32 must keep its sign.
        match difference as f32 {
            0.0 if difference > 0.0 => f32::MIN_POSITIVE,
            0.0 if difference < 0.0 => -f32::MIN_POSITIVE,
            rounded => rounded,
        }
    }))
}
