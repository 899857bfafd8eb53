//! An empty room with chequered walls: a tracer whose every value has a closed form.

use coshade_reference::accel::Sees;
use glam::{DVec2, DVec3};

use super::{DepthSample, Tracer, View, ViewRay};

/// A box around the world's origin, seen from inside. Each wall is chequered in two radiances that do not depend on the
/// direction; nothing virtual stands in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// Half the lengths along x, y and z, metres.
    pub half_size_m: DVec3,
    /// Side of a square, metres; squares meet in the middle of each wall.
    pub square_m: f64,
    /// Radiance of the square at positive coordinates, and of those beside it.
    pub radiances: [[f32; 3]; 2],
    /// Rays a pixel, along each side. Higher: smoother edges.
    pub rays_per_side: u32,
}

impl Default for Room {
    fn default() -> Self {
        Self {
            half_size_m: DVec3::new(2.5, 2.0, 1.25),
            square_m: 0.5,
            radiances: [[0.7, 0.65, 0.6], [0.12, 0.14, 0.18]],
            rays_per_side: 4,
        }
    }
}

impl Room {
    /// Distance to the wall that a ray meets from inside, and the wall's axis.
    fn wall(&self, ray: &ViewRay) -> Option<(f64, usize)> {
        let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
        let half = self.half_size_m.to_array();
        let mut nearest: Option<(f64, usize)> = None;
        for axis in 0..3 {
            let distance = (half[axis].copysign(direction[axis]) - origin[axis]) / direction[axis];
            if distance > 0.0 && nearest.is_none_or(|(nearest, _)| distance < nearest) {
                nearest = Some((distance, axis));
            }
        }
        nearest
    }

    fn colour(&self, ray: &ViewRay) -> [f32; 3] {
        let Some((distance, axis)) = self.wall(ray) else { return [0.0; 3] };
        let point = ray.origin + ray.direction * distance;
        let on_wall = match axis {
            0 => DVec2::new(point.y, point.z),
            1 => DVec2::new(point.x, point.z),
            _ => DVec2::new(point.x, point.y),
        };
        let square = (on_wall / self.square_m).floor();
        self.radiances[(square.x + square.y).rem_euclid(2.0) as usize % 2]
    }
}

impl Tracer for Room {
    fn radiance(&self, view: &View<'_>) -> Vec<[f32; 3]> {
        let side = self.rays_per_side.max(1);
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(side) - 0.5;
        view.each_pixel(|x, y| {
            let mut sum = [0.0_f64; 3];
            for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
                let ray = view.ray(f64::from(x) + place(i), f64::from(y) + place(j));
                let colour = ray.map_or([0.0; 3], |ray| self.colour(&ray));
                sum.iter_mut().zip(colour).for_each(|(sum, part)| *sum += f64::from(part));
            }
            sum.map(|sum| (sum / f64::from(side * side)) as f32)
        })
    }

    fn depth(&self, view: &View<'_>) -> Vec<DepthSample> {
        view.each_pixel(|x, y| {
            let sample = view.ray(f64::from(x), f64::from(y)).and_then(|ray| {
                let (distance, axis) = self.wall(&ray)?;
                let cos_incidence = ray.direction.to_array()[axis].abs() as f32;
                Some(DepthSample { z_m: (distance * ray.depth_per_m) as f32, cos_incidence })
            });
            sample.unwrap_or(DepthSample::NOTHING)
        })
    }

    fn key(&self) -> String {
        format!("{self:?} {:?}", Sees::RealOnly)
    }
}
