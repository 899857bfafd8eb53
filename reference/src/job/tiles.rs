//! The picture in tiles, the unit of work.

use std::ops::Range;

use super::Shard;
use crate::camera::Camera;
use crate::film::{FilmPixel, PixelSums};
use crate::integrator::{EyePath, Settings, TraceScene};
use crate::photon::PhotonMap;
use crate::random::Sampler;

/// Side of a tile.
const SIDE_PX: u32 = 16;

/// What a pass needs.
pub(super) struct PassView<'a> {
    pub scene: &'a TraceScene,
    pub camera: &'a Camera,
    pub settings: Settings,
    pub seed: u32,
    pub photons: Option<&'a PhotonMap>,
    /// Numbers of the samples to take.
    pub samples: Range<u32>,
}

/// A rectangle of pixels.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    columns: Range<u32>,
    rows: Range<u32>,
    sums: Vec<PixelSums>,
    rejected_samples: u64,
}

/// The tiles of a shard.
pub(super) fn of_shard([width, height]: [u32; 2], shard: Shard) -> Vec<Tile> {
    let across = width.div_ceil(SIDE_PX);
    (shard.index..across * height.div_ceil(SIDE_PX))
        .step_by(shard.count as usize)
        .map(|number| Tile::new([width, height], number % across, number / across))
        .collect()
}

impl Tile {
    fn new([width, height]: [u32; 2], column: u32, row: u32) -> Self {
        let range = |number: u32, end: u32| number * SIDE_PX..(number * SIDE_PX + SIDE_PX).min(end);
        let (columns, rows) = (range(column, width), range(row, height));
        let sums = vec![PixelSums::default(); columns.len() * rows.len()];
        Self { columns, rows, sums, rejected_samples: 0 }
    }

    /// Takes samples of all pixels.
    pub(super) fn render(&mut self, view: &PassView<'_>) {
        let places = pixels(&self.columns, &self.rows);
        for (pixel, sums) in places.zip(&mut self.sums) {
            for sample in view.samples.clone() {
                let sampler = Sampler::new(pixel, sample, view.seed);
                let place = sampler.clone().next_2d();
                let Some(ray) = view.camera.ray(pixel, place) else {
                    sums.add_nothing();
                    continue;
                };
                let path = EyePath::trace(view.scene, view.settings, view.photons, &ray, sampler);
                let fine = sums.add(&path.radiance, path.first.as_ref(), ray.depth_per_m);
                self.rejected_samples += u64::from(!fine);
            }
        }
    }

    /// All pixels with their places.
    pub(super) fn finish(&self) -> impl Iterator<Item = ([u32; 2], FilmPixel)> {
        pixels(&self.columns, &self.rows).zip(self.sums.iter().map(PixelSums::finish))
    }

    pub(super) fn rejected_samples(&self) -> u64 {
        self.rejected_samples
    }
}

fn pixels(columns: &Range<u32>, rows: &Range<u32>) -> impl Iterator<Item = [u32; 2]> + use<> {
    let columns = columns.clone();
    rows.clone().flat_map(move |y| columns.clone().map(move |x| [x, y]))
}
