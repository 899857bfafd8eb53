//! The equal-area octahedral map of the whole sphere.
//!
//! P. Clarberg, *Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD*, Journal of Graphics Tools 13(3), 2008
//! (the form of pbrt-v4, `EqualAreaSquareToSphere`). The pole is **+Z of the frame the map is expressed in**:
//! +Z is the centre of the square, −Z its four corners, the horizon (z = 0) the diamond |s| + |t| = 1 with
//! s = 2u − 1, t = 2v − 1; +X lies to the right (u = 1, v = ½), +Y downwards (u = ½, v = 1). Every part of the
//! square has the same share of the sphere as of the square: a texel of an n×n map has the solid angle 4π/n².
//!
//! Beyond an edge of the square the map goes on, turned by 180° about the middle of that edge. Repeating this
//! tiles the plane without a gap, also around the corners, so a look-up may run over the fold in any direction.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, PI};

use nalgebra::{Vector2, Vector3};

use crate::pixel::{RasterPx, Uv};

/// The place of a direction (any length) in the unit square; `None` for the zero vector or one that is not finite.
pub fn uv_from_direction(direction: &Vector3<f64>) -> Option<Uv> {
    let norm = direction.norm();
    if !(norm.is_finite() && norm > 0.0) {
        return None;
    }
    let d = direction / norm;
    // √(1−|z|) without the cancellation near the poles.
    let r = d.x.hypot(d.y) / (1.0 + d.z.abs()).sqrt();
    // Measured from the nearer axis, so that directions on an axis land exactly on it.
    let (x, y) = (d.x.abs(), d.y.abs());
    let (mut s, mut t) = if y <= x {
        let t = r * FRAC_2_PI * angle(y, x);
        (r - t, t)
    } else {
        let s = r * FRAC_2_PI * angle(x, y);
        (s, r - s)
    };
    if d.z < 0.0 {
        (s, t) = (1.0 - t, 1.0 - s);
    }
    Some(Uv::new((1.0 + s.copysign(d.x)) / 2.0, (1.0 + t.copysign(d.y)) / 2.0))
}

fn angle(opposite: f64, adjacent: f64) -> f64 {
    if opposite == 0.0 { 0.0 } else { opposite.atan2(adjacent) }
}

/// The unit direction of a place in the square. Places outside of it are first brought back over the fold
/// ([`fold`]); the result is a unit vector for every finite place.
pub fn direction_from_uv(uv: Uv) -> Vector3<f64> {
    let square = fold(uv.0 * 2.0 - Vector2::new(1.0, 1.0));
    let (s, t) = (square.x.abs(), square.y.abs());
    let distance_from_horizon = 1.0 - (s + t);
    // On the lower half the square's corner plays the part of the centre, with the axes swapped.
    let (a, b) = if distance_from_horizon < 0.0 { (1.0 - t, 1.0 - s) } else { (s, t) };
    let r = a + b;
    let (sin_phi, cos_phi) = if r <= 0.0 {
        (0.0, 1.0)
    } else if b <= a {
        (b / r * FRAC_PI_2).sin_cos()
    } else {
        let (sin, cos) = (a / r * FRAC_PI_2).sin_cos();
        (cos, sin)
    };
    let z = (1.0 - r * r).copysign(distance_from_horizon);
    let sin_theta = r * (2.0 - r * r).max(0.0).sqrt();
    Vector3::new((sin_theta * cos_phi).copysign(square.x), (sin_theta * sin_phi).copysign(square.y), z)
}

/// Brings a point of the tiled plane, in coordinates where the square is [−1,1]², back into the square: half
/// turns about the middles of its edges.
pub fn fold(square: Vector2<f64>) -> Vector2<f64> {
    if square.x.abs() <= 1.0 && square.y.abs() <= 1.0 {
        return square;
    }
    // Two half turns are a translation by (±2, ±2), which keeps the parity of the tile; an odd tile is turned.
    let tile_x = ((square.x + 1.0) / 2.0).floor();
    let tile_y = ((square.y + 1.0) / 2.0).floor();
    let local = Vector2::new(square.x - 2.0 * tile_x, square.y - 2.0 * tile_y);
    if (tile_x + tile_y).rem_euclid(2.0) == 0.0 { local } else { -local }
}

/// The texel that lies at index (x, y) of the tiled plane: the index itself inside an n×n map (n > 0), and the
/// neighbour across the fold outside of it.
pub fn fold_texel(x: i64, y: i64, n: u32) -> (u32, u32) {
    let n = i64::from(n);
    let (tile_x, tile_y) = (x.div_euclid(n), y.div_euclid(n));
    let (mut x, mut y) = (x.rem_euclid(n), y.rem_euclid(n));
    if (tile_x + tile_y).rem_euclid(2) != 0 {
        (x, y) = (n - 1 - x, n - 1 - y);
    }
    (x as u32, y as u32)
}

/// The unit direction of the centre of texel (x, y) of an n×n map.
pub fn texel_direction(x: u32, y: u32, n: u32) -> Vector3<f64> {
    direction_from_uv(RasterPx::center_of(x, y).to_uv([n, n]))
}

/// The solid angle of every texel of an n×n map, 4π/n², in steradian.
pub fn texel_solid_angle_sr(n: u32) -> f64 {
    4.0 * PI / (f64::from(n) * f64::from(n))
}

/// The image of the point `p` of the tiled plane ([−1,1]² coordinates) that is nearest to `reference`:
/// both stand for the same direction. Used to follow an outline over the fold.
pub fn nearest_image(p: Vector2<f64>, reference: Vector2<f64>) -> Vector2<f64> {
    let mut best = p;
    for y in -2..=2_i32 {
        for x in -2..=2_i32 {
            let turned = if (x + y).rem_euclid(2) == 0 { p } else { -p };
            let image = turned + Vector2::new(2.0 * f64::from(x), 2.0 * f64::from(y));
            if (image - reference).norm_squared() < (best - reference).norm_squared() {
                best = image;
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn direction(u: f64, v: f64) -> Vector3<f64> {
        direction_from_uv(Uv::new(u, v))
    }

    /// The signed solid angle of a spherical triangle (van Oosterom and Strackee 1983, eq. 8).
    fn triangle_sr(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> f64 {
        2.0 * a.dot(&b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    }

    #[test]
    fn axes_lie_where_the_documentation_says() {
        for (uv, axis) in [
            ((0.5, 0.5), Vector3::z()),
            ((1.0, 0.5), Vector3::x()),
            ((0.0, 0.5), -Vector3::x()),
            ((0.5, 1.0), Vector3::y()),
            ((0.5, 0.0), -Vector3::y()),
            ((0.0, 0.0), -Vector3::z()),
            ((1.0, 0.0), -Vector3::z()),
            ((0.0, 1.0), -Vector3::z()),
            ((1.0, 1.0), -Vector3::z()),
        ] {
            assert!((direction(uv.0, uv.1) - axis).norm() < 1e-15, "{uv:?}");
        }
        assert_eq!(uv_from_direction(&Vector3::z()), Some(Uv::new(0.5, 0.5)));
    }

    #[test]
    fn nothing_but_directions_has_a_place() {
        assert_eq!(uv_from_direction(&Vector3::zeros()), None);
        assert_eq!(uv_from_direction(&Vector3::new(f64::NAN, 0.0, 1.0)), None);
        assert_eq!(uv_from_direction(&Vector3::new(f64::INFINITY, 0.0, 1.0)), None);
    }

    /// Every texel's outline, followed along the map in steps too short to matter, encloses 4π/n². The error of
    /// replacing an outline of k steps by chords falls with 1/k², which Richardson's rule removes.
    #[test]
    fn every_texel_has_the_same_solid_angle() {
        let n = 10;
        for y in 0..n {
            for x in 0..n {
                let outline = |steps: u32| -> f64 {
                    let at = |i: u32, j: u32| {
                        let to = |texel: u32, k: u32| f64::from(texel * steps + k) / f64::from(n * steps);
                        direction(to(x, i), to(y, j))
                    };
                    let mut points = Vec::new();
                    points.extend((0..steps).map(|k| at(k, 0)));
                    points.extend((0..steps).map(|k| at(steps, k)));
                    points.extend((0..steps).map(|k| at(steps - k, steps)));
                    points.extend((0..steps).map(|k| at(0, steps - k)));
                    let center = at(steps / 2, steps / 2);
                    (0..points.len())
                        .map(|i| triangle_sr(&center, &points[i], &points[(i + 1) % points.len()]))
                        .sum()
                };
                let area = (4.0 * outline(128) - outline(64)) / 3.0;
                let relative = area.abs() / texel_solid_angle_sr(n) - 1.0;
                assert!(relative.abs() < 1e-6, "texel ({x}, {y}): {relative:e}");
            }
        }
    }

    /// Beyond the fold lies the texel that continues the sphere: neighbours over an edge are as close to each
    /// other as neighbours inside.
    #[test]
    fn neighbours_over_the_fold_are_neighbours_on_the_sphere() {
        let n = 16;
        for k in 0..n {
            for (outside, inside) in [
                ((i64::from(k), -1), (k, 0)),
                ((i64::from(k), i64::from(n)), (k, n - 1)),
                ((-1, i64::from(k)), (0, k)),
                ((i64::from(n), i64::from(k)), (n - 1, k)),
            ] {
                let (x, y) = fold_texel(outside.0, outside.1, n);
                let angle = texel_direction(x, y, n).angle(&texel_direction(inside.0, inside.1, n));
                assert!(angle < 2.0 * texel_solid_angle_sr(n).sqrt(), "{outside:?}: {angle}");
                let continued = direction_from_uv(Uv::new(
                    (outside.0 as f64 + 0.5) / f64::from(n),
                    (outside.1 as f64 + 0.5) / f64::from(n),
                ));
                assert!((continued - texel_direction(x, y, n)).norm() < 1e-14);
            }
        }
        assert_eq!(fold_texel(-1, -1, n), (n - 1, n - 1));
        assert_eq!(fold_texel(i64::from(n), -1, n), (0, n - 1));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn direction_to_square_and_back(z in -1.0_f64..=1.0, phi in 0.0..2.0 * PI) {
            let r = (1.0 - z * z).sqrt();
            let d = Vector3::new(r * phi.cos(), r * phi.sin(), z);
            let uv = uv_from_direction(&d).unwrap();
            prop_assert!(uv.0.iter().all(|c| (0.0..=1.0).contains(c)));
            prop_assert!((direction_from_uv(uv) - d.normalize()).norm() < 1e-14 * 10.0);
        }

        /// As above a hair's breadth from a pole, an axis plane or the horizon.
        #[test]
        fn stable_at_poles_and_seams(
            exponents in prop::array::uniform3(-300_i32..=0),
            signs in prop::array::uniform3(prop::bool::ANY),
        ) {
            let part = |i: usize| 10_f64.powi(exponents[i]) * if signs[i] { 1.0 } else { -1.0 };
            let d = Vector3::new(part(0), part(1), part(2));
            prop_assume!(d.norm() > 1e-150);
            let back = direction_from_uv(uv_from_direction(&d).unwrap());
            prop_assert!((back - d / d.norm()).norm() < 1e-12, "{d:?} {back:?}");
        }

        #[test]
        fn square_to_direction_and_back(u in 0.0..1.0_f64, v in 0.0..1.0_f64) {
            let d = direction(u, v);
            prop_assert!((d.norm() - 1.0).abs() < 1e-15 * 4.0);
            let back = uv_from_direction(&d).unwrap().0;
            prop_assert!((back - Vector2::new(u, v)).norm() < 1e-12, "{back:?}");
        }

        #[test]
        fn all_images_of_a_point_are_one_direction(s in -5.0..5.0_f64, t in -5.0..5.0_f64) {
            let p = Vector2::new(s, t);
            let folded = fold(p);
            prop_assert!(folded.amax() <= 1.0);
            prop_assert!((nearest_image(folded, p) - p).norm() < 1e-12 || p.amax() > 4.0);
        }
    }
}
