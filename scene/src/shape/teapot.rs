//! The Utah teapot.

use std::array;

use glam::{DVec3, Vec2, Vec3};

use super::builder::{Builder, Vertex};
use super::{ShapeError, check_segments, check_size};
use crate::mesh::Mesh;

/// Most segments along an edge of a patch (32 patches: a million triangles).
const MAX_PATCH_SEGMENTS: u32 = 128;
/// From the table to the knob in the data's unit.
const HEIGHT: f64 = 3.15;
/// Where the inner control points of a quarter circle lie, in radii. Newell's value; a true circle has 0.5523.
const QUARTER: f64 = 0.56;

/// Control points (radius, z, side) of what is turned around the axis, from the bottom outwards, up and in again;
/// `side` is the sideward offset of the two inner control points of each quarter.
const PROFILE: [[[f64; 3]; 4]; 6] = [
    [on(0.0, 0.0), on(1.425, 0.0), on(1.5, 0.075), on(1.5, 0.15)],
    [on(1.5, 0.15), on(1.5, 0.225), on(2.0, 0.45), on(2.0, 0.9)],
    [on(2.0, 0.9), on(2.0, 1.35), on(1.75, 1.875), on(1.5, 2.4)],
    [on(1.5, 2.4), on(1.4375, 2.53125), on(1.3375, 2.53125), on(1.4, 2.4)],
    [on(1.3, 2.4), on(1.3, 2.55), on(0.4, 2.55), on(0.2, 2.7)],
    [on(0.2, 2.7), on(0.0, 2.85), [0.8, 3.15, 0.45], on(0.0, 3.15)],
];
/// The rim ends with this piece of [`PROFILE`], the lid begins after it.
const RIM: usize = 3;

/// The handle from top to bottom and the spout from body to tip, each two patches of the half with y ≤ 0.
/// Rows run along the tube, the four columns from one side of the symmetry plane around to the other.
const HANDLE: [[[[f64; 3]; 4]; 4]; 2] = [
    [
        tube([-1.6, 2.025], [-1.5, 2.25], 0.3),
        tube([-2.3, 2.025], [-2.5, 2.25], 0.3),
        tube([-2.7, 2.025], [-3.0, 2.25], 0.3),
        tube([-2.7, 1.8], [-3.0, 1.8], 0.3),
    ],
    [
        tube([-2.7, 1.8], [-3.0, 1.8], 0.3),
        tube([-2.7, 1.575], [-3.0, 1.35], 0.3),
        tube([-2.5, 1.125], [-2.65, 0.9375], 0.3),
        tube([-2.0, 0.9], [-1.9, 0.6], 0.3),
    ],
];
const SPOUT: [[[[f64; 3]; 4]; 4]; 2] = [
    [
        tube([1.7, 1.425], [1.7, 0.6], 0.66),
        tube([2.6, 1.425], [3.1, 0.825], 0.66),
        tube([2.3, 2.1], [2.4, 2.025], 0.25),
        tube([2.7, 2.4], [3.3, 2.4], 0.25),
    ],
    [
        tube([2.7, 2.4], [3.3, 2.4], 0.25),
        tube([2.8, 2.475], [3.525, 2.49375], 0.25),
        tube([2.9, 2.475], [3.45, 2.5125], 0.15),
        tube([2.8, 2.4], [3.2, 2.4], 0.15),
    ],
];

const fn on(radius: f64, z: f64) -> [f64; 3] {
    [radius, z, QUARTER * radius]
}

const fn tube(from_xz: [f64; 2], to_xz: [f64; 2], half_width: f64) -> [[f64; 3]; 4] {
    [
        [from_xz[0], 0.0, from_xz[1]],
        [from_xz[0], -half_width, from_xz[1]],
        [to_xz[0], -half_width, to_xz[1]],
        [to_xz[0], 0.0, to_xz[1]],
    ]
}

/// Whether the teapot can hold light in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TeapotLid {
    /// Newell's 32 patches and nothing else: a slit around the lid, handle and spout are open tubes.
    Open,
    /// The slit, the tip of the spout and the ends inside the body are filled by flat faces: three closed surfaces
    /// (pot, handle, spout) that overlap. A refractor needs this.
    Sealed,
}

/// Newell's teapot (University of Utah, 1975) from the 32 bicubic Bézier patches of the original measurements, bottom
/// included. It stands on z = 0 around the origin, the spout towards +x; 3.15 units of the data are `height_m`, so it is
/// 2.042 times as wide as high.
///
/// `segments` quads along each edge of each patch. Neighbouring patches share their edge points bit by bit. Normals are
/// those of the patches, at the two poles (bottom and knob, where one edge of the patch is a point) their limit.
///
/// # Errors
/// [`ShapeError`] for a height that is not positive and finite, or for segments outside 2–128.
pub fn teapot(height_m: f32, segments: u32, lid: TeapotLid) -> Result<Mesh, ShapeError> {
    check_size("teapot", "height_m", height_m)?;
    check_segments("teapot", segments, 2, MAX_PATCH_SEGMENTS)?;
    let mut pot = Teapot { builder: Builder::default(), segments, scale: f64::from(height_m) / HEIGHT };
    pot.turned(lid);
    pot.tubes(&HANDLE, lid);
    pot.tubes(&SPOUT, lid);
    Ok(pot.builder.finish("teapot"))
}

/// Control points, `[row][column]`.
type Patch = [[DVec3; 4]; 4];

struct Teapot {
    builder: Builder,
    segments: u32,
    scale: f64,
}

impl Teapot {
    fn turned(&mut self, lid: TeapotLid) {
        let count = PROFILE.len() as f64;
        for quarter in 0..4 {
            for (number, piece) in PROFILE.iter().enumerate() {
                let patch = piece.map(|control| turned_row(control, quarter));
                self.patch(&patch, |u, v| {
                    Vec2::new(
                        (u + f64::from(quarter)) as f32 / 4.0,
                        1.0 - ((v + number as f64) / count) as f32,
                    )
                });
            }
            if lid == TeapotLid::Sealed {
                self.slit(quarter);
            }
        }
    }

    /// Flat ring between rim and lid.
    fn slit(&mut self, quarter: u32) {
        let [outer, inner] = [PROFILE[RIM][3], PROFILE[RIM + 1][0]].map(|row| turned_row(row, quarter));
        let (segments, scale) = (self.segments, self.scale);
        self.builder.grid(segments, 1, |column, row| {
            let edge = if row == 0 { outer } else { inner };
            let u = share(column, segments);
            let position = (curve(&edge, u) * scale).as_vec3();
            let uv = Vec2::new((u as f32 + quarter as f32) / 4.0, 1.0 - row as f32);
            Vertex { position, normal: Vec3::Z, uv }
        });
    }

    fn tubes(&mut self, halves: &[[[[f64; 3]; 4]; 4]; 2], lid: TeapotLid) {
        let near = halves.map(|patch| patch.map(|row| row.map(DVec3::from_array)));
        let far = near.map(|patch| patch.map(mirrored));
        for (number, (near, far)) in near.iter().zip(&far).enumerate() {
            for (side, patch) in [near, far].into_iter().enumerate() {
                self.patch(patch, |u, v| {
                    Vec2::new((u + side as f64) as f32 / 2.0, 1.0 - ((v + number as f64) / 2.0) as f32)
                });
            }
        }
        if lid == TeapotLid::Sealed {
            let mut start = self.rim(&near[0][0], &far[0][0]);
            start.reverse();
            self.cap(&start);
            let end = self.rim(&near[1][3], &far[1][3]);
            self.cap(&end);
        }
    }

    /// Points around the end of a tube, without repeating the first.
    fn rim(&self, near: &[DVec3; 4], far: &[DVec3; 4]) -> Vec<Vec3> {
        let half = |row: [DVec3; 4]| {
            (0..self.segments).map(move |i| (curve(&row, share(i, self.segments)) * self.scale).as_vec3())
        };
        half(*near).chain(half(*far)).collect()
    }

    fn cap(&mut self, rim: &[Vec3]) {
        let doubled_area = rim.iter().zip(rim.iter().cycle().skip(1)).map(|(a, b)| a.cross(*b)).sum::<Vec3>();
        self.builder.fan(rim, doubled_area.normalize_or(Vec3::Z));
    }

    fn patch(&mut self, patch: &Patch, uv: impl Fn(f64, f64) -> Vec2) {
        let (segments, scale) = (self.segments, self.scale);
        self.builder.grid(segments, segments, |column, row| {
            let (u, v) = (share(column, segments), share(row, segments));
            let position = (point(patch, u, v) * scale).as_vec3();
            Vertex { position, normal: normal(patch, u, v).as_vec3(), uv: uv(u, v) }
        });
    }
}

/// Exactly 0 and 1 at the ends.
fn share(step: u32, steps: u32) -> f64 {
    f64::from(step) / f64::from(steps)
}

/// A row of control points of one quarter of the turned body.
fn turned_row([radius, z, side]: [f64; 3], quarter: u32) -> [DVec3; 4] {
    [[radius, 0.0], [radius, side], [side, radius], [0.0, radius]].map(|[x, y]| match quarter {
        0 => DVec3::new(x, y, z),
        1 => DVec3::new(-y, x, z),
        2 => DVec3::new(-x, -y, z),
        _ => DVec3::new(y, -x, z),
    })
}

/// The other half of a tube, its columns in reverse so that the front stays outside.
fn mirrored(row: [DVec3; 4]) -> [DVec3; 4] {
    let [a, b, c, d] = row.map(|point| DVec3::new(point.x, -point.y, point.z));
    [d, c, b, a]
}

fn bernstein(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}

fn bernstein_slope(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t]
}

fn weighted(weights: [f64; 4], points: &[DVec3; 4]) -> DVec3 {
    weights.iter().zip(points).map(|(weight, point)| *weight * *point).sum()
}

fn curve(row: &[DVec3; 4], u: f64) -> DVec3 {
    weighted(bernstein(u), row)
}

/// `Σ w_j(v) Σ w_i(u) P_ji`, for values or slopes in either direction.
fn surface(patch: &Patch, along_u: [f64; 4], along_v: [f64; 4]) -> DVec3 {
    let rows = array::from_fn(|row| weighted(along_u, &patch[row]));
    weighted(along_v, &rows)
}

fn point(patch: &Patch, u: f64, v: f64) -> DVec3 {
    surface(patch, bernstein(u), bernstein(v))
}

/// Unit normal `∂u × ∂v`. Where the row is a single point (∂u = 0, at v = 0 or 1) its limit from inside the patch:
/// there `∂u ≈ ∂²/∂u∂v · δv`, with δv pointing inward.
fn normal(patch: &Patch, u: f64, v: f64) -> DVec3 {
    let along_u = surface(patch, bernstein_slope(u), bernstein(v));
    let along_v = surface(patch, bernstein(u), bernstein_slope(v));
    let product = along_u.cross(along_v);
    if product.length_squared() > 1e-20 {
        return product.normalize_or_zero();
    }
    let inward = if v < 0.5 { 1.0 } else { -1.0 };
    let twist = surface(patch, bernstein_slope(u), bernstein_slope(v)) * inward;
    twist.cross(along_v).normalize_or(DVec3::Z)
}
