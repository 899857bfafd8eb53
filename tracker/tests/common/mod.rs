//! Pictures of tags whose truth is known: every pixel is the mean of rays through the lens onto the printed cells.
#![allow(dead_code, reason = "each test uses a part")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "helpers of tests may panic")]

use coshade_lens::model::CameraModel;
use coshade_tracker::{Luma, TagBitmap, TagId, UNIT_CORNERS, tag_bitmap};
use nalgebra::{Isometry3, Point3, Vector2};

/// A printed tag in front of the camera.
pub struct PlacedTag {
    pub tag: TagId,
    pub size_m: f64,
    pub camera_from_tag: Isometry3<f64>,
}

impl PlacedTag {
    pub fn corners_px(&self, lens: &CameraModel) -> [Vector2<f64>; 4] {
        UNIT_CORNERS.map(|[x, y]| {
            let corner = self.camera_from_tag * Point3::new(x * self.size_m, y * self.size_m, 0.0);
            lens.project(&corner.coords).expect("the tag is in the field of view")
        })
    }

    /// Light that comes along a ray, if it meets the sheet.
    fn light(&self, bitmap: &TagBitmap, ray: &nalgebra::Vector3<f64>, look: &Look) -> Option<f64> {
        let tag_from_camera = self.camera_from_tag.inverse();
        let (origin, direction) = (tag_from_camera.translation.vector, tag_from_camera.rotation * ray);
        let distance = -origin.z / direction.z;
        if distance.is_nan() || distance <= 0.0 {
            return None;
        }
        let place = (origin + direction * distance).xy() / self.size_m;
        let (cells, between) = (f64::from(bitmap.cells), f64::from(bitmap.cells_between_corners));
        let (column, row) = (0.5 * cells + place.x * between, 0.5 * cells - place.y * between);
        let inside = (0.0..cells).contains(&column) && (0.0..cells).contains(&row);
        let white = || bitmap.is_white(column as u32, row as u32);
        inside.then(|| if white() { look.white } else { look.black })
    }
}

/// Light and flaws of a picture.
#[derive(Clone, Copy)]
pub struct Look {
    pub black: f64,
    pub white: f64,
    pub background: f64,
    /// Standard deviation of a Gaussian blur.
    pub blur_px: f64,
    /// Standard deviation of the noise, in codes.
    pub noise: f64,
    pub seed: u64,
}

impl Default for Look {
    fn default() -> Self {
        Self { black: 30.0, white: 200.0, background: 110.0, blur_px: 0.7, noise: 2.0, seed: 1 }
    }
}

pub struct Picture {
    pub pixels: Vec<u8>,
    pub size_px: [u32; 2],
}

impl Picture {
    pub fn luma(&self) -> Luma<'_> {
        Luma::new(&self.pixels, self.size_px[0], self.size_px[1], self.size_px[0]).unwrap()
    }
}

/// Rays per pixel along each side.
const RAYS: u32 = 6;

pub fn picture(lens: &CameraModel, size_px: [u32; 2], tags: &[PlacedTag], look: &Look) -> Picture {
    let [width, height] = size_px.map(|side| side as usize);
    let mut light = vec![look.background; width * height];
    for placed in tags {
        let bitmap = tag_bitmap(placed.tag.family, placed.tag.id).unwrap();
        let corners = placed.corners_px(lens);
        let center = corners.iter().sum::<Vector2<f64>>() / 4.0;
        let reach = corners.iter().map(|corner| (corner - center).norm()).fold(0.0, f64::max) * 2.0 + 3.0;
        let range = |middle: f64, side: usize| {
            (middle - reach).max(0.0) as usize..=((middle + reach).max(0.0) as usize).min(side - 1)
        };
        for y in range(center.y, height) {
            for x in range(center.x, width) {
                let rays = (0..RAYS * RAYS).map(|ray| {
                    let offset = |i: u32| (f64::from(i) + 0.5) / f64::from(RAYS) - 0.5;
                    let px = Vector2::new(x as f64 + offset(ray % RAYS), y as f64 + offset(ray / RAYS));
                    lens.unproject(&px).and_then(|ray| placed.light(&bitmap, &ray, look))
                });
                let pixel = &mut light[y * width + x];
                let behind = *pixel;
                *pixel = rays.map(|light| light.unwrap_or(behind)).sum::<f64>() / f64::from(RAYS * RAYS);
            }
        }
    }
    let light = blurred(&light, width, look.blur_px);
    coded(&light, size_px, look.noise, look.seed)
}

/// The same picture taken again, with other noise, in codes.
pub fn noisy(picture: &Picture, noise: f64, seed: u64) -> Picture {
    let light: Vec<f64> = picture.pixels.iter().map(|code| f64::from(*code)).collect();
    coded(&light, picture.size_px, noise, seed)
}

fn coded(light: &[f64], size_px: [u32; 2], noise: f64, seed: u64) -> Picture {
    let mut random = Random(seed);
    let pixels = light.iter().map(|light| (light + noise * random.normal()).round().clamp(0.0, 255.0) as u8);
    Picture { pixels: pixels.collect(), size_px }
}

fn blurred(light: &[f64], width: usize, sigma: f64) -> Vec<f64> {
    if sigma <= 0.0 {
        return light.to_vec();
    }
    let reach = (4.0 * sigma).ceil() as i64;
    let kernel: Vec<f64> = (-reach..=reach).map(|x| (-0.5 * (x as f64 / sigma).powi(2)).exp()).collect();
    let sum: f64 = kernel.iter().sum();
    let height = light.len() / width;
    let pass = |from: &[f64], dx: i64, dy: i64| -> Vec<f64> {
        (0..from.len())
            .map(|index| {
                let (x, y) = ((index % width) as i64, (index / width) as i64);
                let tap = |k: i64| {
                    let at = |v: i64, side: usize| v.clamp(0, side as i64 - 1) as usize;
                    from[at(y + k * dy, height) * width + at(x + k * dx, width)]
                };
                kernel.iter().zip(-reach..).map(|(weight, k)| weight * tap(k)).sum::<f64>() / sum
            })
            .collect()
    };
    pass(&pass(light, 1, 0), 0, 1)
}

/// SplitMix64: small, seeded, good enough for noise.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Mean 0, variance 1 (Box–Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().max(1e-300).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}
