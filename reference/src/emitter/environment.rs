//! Light from infinitely far away: a map of radiance over all directions.
//!
//! Directions are drawn texel by texel, by luminance × solid angle, uniformly in solid angle within a texel; the density
//! is exact for both interpolations, because it is the mean of the interpolated radiance over the texel that counts, and
//! the mean of a bilinear interpolant over a texel is its 3×3 neighbourhood weighted by (⅛, ¾, ⅛)².

use std::f64::consts::{PI, TAU};

use coshade_lens::octahedral;
use coshade_lens::pixel::Uv;
use coshade_scene::World;
use glam::{DVec3, Vec2, Vec3};
use nalgebra::Vector3;
use thiserror::Error;

use super::distribution::Grid;
use crate::bsdf::luminance;
use coshade_image_file::Image;

/// How directions lie on the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Square, [`coshade_lens::octahedral`]: +Z is its centre, +X to the right.
    Octahedral,
    /// Rows from +Z down to −Z, columns around; the middle column looks along +X, and azimuth falls to the right (as one
    /// who looks out sees it, and as Blender has it).
    LatLong,
}

/// Radiance between texel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Constant over each texel.
    Nearest,
    /// Between the four nearest centres.
    #[default]
    Bilinear,
}

/// Why a map is no environment.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum EnvironmentError {
    /// Sizes that do not fit.
    #[error("environment of {width}x{height} texels with {found} values: {expected}")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Number of texels given.
        found: usize,
        /// What would be right.
        expected: &'static str,
    },
    /// Not a radiance.
    #[error("environment texel ({x}, {y}) is {value}, expected finite numbers that are not negative")]
    Texel {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// What is there.
        value: Vec3,
    },
    /// An image without colour.
    #[error("environment image: expected channels R, G and B")]
    Channels,
    /// A rotation that is none.
    #[error("environment: yaw_rad = {0}, expected a finite angle")]
    Yaw(f32),
}

/// A map of radiance. It is always real: it is measured.
#[derive(Clone, Debug)]
pub struct Environment {
    layout: Layout,
    interpolation: Interpolation,
    width: usize,
    height: usize,
    texels: Vec<Vec3>,
    /// World from map, about +Z.
    yaw: Vec2,
    /// `None` for a black map.
    cells: Option<Grid>,
}

impl Environment {
    /// From `texels[y · width + x]`. `yaw_rad` turns the map counter-clockwise about the world's +Z.
    ///
    /// # Errors
    /// [`EnvironmentError`] names what does not fit, or the texel that is no radiance.
    pub fn new(
        layout: Layout,
        [width, height]: [usize; 2],
        texels: Vec<Vec3>,
        interpolation: Interpolation,
        yaw_rad: f32,
    ) -> Result<Self, EnvironmentError> {
        let found = texels.len();
        let size = |expected| EnvironmentError::Size { width, height, found, expected };
        if found == 0 || width.checked_mul(height) != Some(found) {
            return Err(size("expected width x height texels, at least one"));
        }
        if layout == Layout::Octahedral && width != height {
            return Err(size("an octahedral map is square"));
        }
        if u32::try_from(width).is_err() || u32::try_from(height).is_err() {
            return Err(size("at most 2^32 - 1 columns and rows"));
        }
        let bad = |texel: &Vec3| !(texel.is_finite() && texel.min_element() >= 0.0);
        if let Some(at) = texels.iter().position(bad) {
            let (x, y, value) = (at % width, at / width, texels[at]);
            return Err(EnvironmentError::Texel { x, y, value });
        }
        if !yaw_rad.is_finite() {
            return Err(EnvironmentError::Yaw(yaw_rad));
        }
        let mut environment = Self {
            layout,
            interpolation,
            width,
            height,
            texels,
            yaw: Vec2::from_angle(yaw_rad),
            cells: None,
        };
        environment.cells = Grid::new(width, &environment.weights());
        Ok(environment)
    }

    /// From an image file.
    ///
    /// # Errors
    /// As [`Environment::new`]; also an image without R, G and B.
    pub fn from_image(
        layout: Layout,
        image: &Image,
        interpolation: Interpolation,
        yaw_rad: f32,
    ) -> Result<Self, EnvironmentError> {
        let plane = |name: &str| {
            let channel = image.channels().iter().find(|channel| channel.name == name);
            channel.map(|channel| channel.samples.as_slice()).ok_or(EnvironmentError::Channels)
        };
        let (r, g, b) = (plane("R")?, plane("G")?, plane("B")?);
        let texels = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| Vec3::new(r, g, b)).collect();
        Self::new(layout, [image.width(), image.height()], texels, interpolation, yaw_rad)
    }

    /// The same radiance from everywhere.
    pub fn constant(radiance: Vec3) -> Result<Self, EnvironmentError> {
        Self::new(Layout::Octahedral, [1, 1], vec![radiance], Interpolation::Nearest, 0.0)
    }

    /// Real.
    pub fn world(&self) -> World {
        World::Real
    }

    /// How directions lie on it.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Row by row.
    pub fn texels(&self) -> &[Vec3] {
        &self.texels
    }

    /// How far the map is turned counter-clockwise about the world's +Z.
    pub fn yaw_rad(&self) -> f32 {
        self.yaw.to_angle()
    }

    /// Luminance integrated over all directions.
    pub fn luminance_sr(&self) -> f64 {
        self.cells.as_ref().map_or(0.0, Grid::total)
    }

    /// Radiance that comes from a world direction (any length but 0).
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let Some([x, y]) = self.texel_coordinates(direction) else {
            return Vec3::ZERO;
        };
        if self.interpolation == Interpolation::Nearest {
            return self.texel(x.floor() as i64, y.floor() as i64);
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = ((x - left) as f32, (y - top) as f32);
        let (left, top) = (left as i64, top as i64);
        let upper = self.texel(left, top).lerp(self.texel(left + 1, top), fx);
        let lower = self.texel(left, top + 1).lerp(self.texel(left + 1, top + 1), fx);
        upper.lerp(lower, fy)
    }

    /// Density per steradian with which [`Environment::sample`] yields a world direction.
    pub fn pdf_sr(&self, direction: Vec3) -> f32 {
        let (Some([x, y]), Some(cells)) = (self.texel_coordinates(direction), &self.cells) else {
            return 0.0;
        };
        let x = (x as usize).min(self.width - 1);
        let y = (y as usize).min(self.height - 1);
        (cells.probability(x, y) / self.texel_sr(y)) as f32
    }

    /// Draws a world direction; `None` from a black map.
    pub fn sample(&self, u2: Vec2) -> Option<Vec3> {
        let ([x, y], [rest_x, rest_y]) = self.cells.as_ref()?.sample(u2)?;
        let u = (x as f64 + f64::from(rest_x)) / self.width as f64;
        let map = match self.layout {
            Layout::Octahedral => {
                let v = (y as f64 + f64::from(rest_y)) / self.height as f64;
                let direction = octahedral::direction_from_uv(Uv::new(u, v));
                DVec3::new(direction.x, direction.y, direction.z)
            }
            Layout::LatLong => {
                let (upper, lower) = self.row_heights(y);
                lat_long_direction(u, upper + (lower - upper) * f64::from(rest_y))
            }
        };
        Some(self.world_from_map(map.as_vec3()))
    }

    fn world_from_map(&self, map: Vec3) -> Vec3 {
        self.yaw.rotate(map.truncate()).extend(map.z)
    }

    fn map_from_world(&self, world: Vec3) -> Vec3 {
        let back = Vec2::new(self.yaw.x, -self.yaw.y);
        back.rotate(world.truncate()).extend(world.z)
    }

    /// Where a world direction lies on the map, in texels from its corner.
    fn texel_coordinates(&self, world: Vec3) -> Option<[f64; 2]> {
        let map = self.map_from_world(world).as_dvec3();
        let [u, v] = match self.layout {
            Layout::Octahedral => {
                let uv = octahedral::uv_from_direction(&Vector3::new(map.x, map.y, map.z))?;
                [uv.0.x, uv.0.y]
            }
            Layout::LatLong => {
                let map = map.try_normalize()?;
                let polar = map.truncate().length().atan2(map.z);
                [0.5 - map.y.atan2(map.x) / TAU, polar / PI]
            }
        };
        Some([u * self.width as f64, v * self.height as f64])
    }

    /// A texel of the map as it goes on beyond its edges.
    fn texel(&self, x: i64, y: i64) -> Vec3 {
        let (width, height) = (self.width as i64, self.height as i64);
        let (x, y) = match self.layout {
            Layout::Octahedral if (0..width).contains(&x) && (0..height).contains(&y) => {
                (x as usize, y as usize)
            }
            Layout::Octahedral => {
                let (x, y) = octahedral::fold_texel(x, y, self.width as u32);
                (x as usize, y as usize)
            }
            Layout::LatLong => (x.rem_euclid(width) as usize, y.clamp(0, height - 1) as usize),
        };
        self.texels.get(y * self.width + x).copied().unwrap_or(Vec3::ZERO)
    }

    fn weights(&self) -> Vec<f64> {
        let weight = |at: usize| {
            let (x, y) = (at % self.width, at / self.width);
            f64::from(luminance(self.mean_radiance(x as i64, y as i64))) * self.texel_sr(y)
        };
        (0..self.texels.len()).map(weight).collect()
    }

    /// Mean of the interpolated radiance over a texel of the map (not of the sphere: for a lat-long map near its poles
    /// the two differ a little, which costs no correctness).
    fn mean_radiance(&self, x: i64, y: i64) -> Vec3 {
        if self.interpolation == Interpolation::Nearest {
            return self.texel(x, y);
        }
        let share = [0.125, 0.75, 0.125];
        let mut mean = Vec3::ZERO;
        for (dy, share_y) in (-1..).zip(share) {
            for (dx, share_x) in (-1..).zip(share) {
                mean += self.texel(x + dx, y + dy) * (share_x * share_y);
            }
        }
        mean
    }

    fn texel_sr(&self, y: usize) -> f64 {
        match self.layout {
            Layout::Octahedral => 4.0 * PI / self.texels.len() as f64,
            Layout::LatLong => {
                let (upper, lower) = self.row_heights(y);
                TAU / self.width as f64 * (upper - lower)
            }
        }
    }

    /// z of the upper and of the lower edge of a row.
    fn row_heights(&self, y: usize) -> (f64, f64) {
        let height = |row: usize| (PI * row as f64 / self.height as f64).cos();
        (height(y), height(y + 1))
    }
}

fn lat_long_direction(u: f64, z: f64) -> DVec3 {
    let azimuth = (0.5 - u) * TAU;
    let across = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(across * azimuth.cos(), across * azimuth.sin(), z)
}
