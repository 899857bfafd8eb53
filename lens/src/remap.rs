//! Area-true remap tables between rasters.
//!
//! For every destination texel a [`RemapTable`] holds a list of source pixels and weights. A weight is the solid
//! angle of the overlap of the texel's footprint with the pixel, divided by the sum over the texel, so a constant
//! stays constant, and radiance × solid angle (the flux) is kept: a lamp of two pixels has the same flux wherever it
//! lies in the image. Point sampling keeps neither where the source is denser than the destination: the lamp blinks
//! as it moves (by a factor of 6.7 from a fish-eye of 512² to an octahedral map of 128²; these tables: by 0.2 %).
//!
//! **Reconstruction.** A source pixel counts as constant over its square (box) where a texel covers one source pixel or
//! more. Where it covers a quarter of a pixel or less that would show the squares, and the source is interpolated
//! linearly between pixel centres (tent), integrated exactly over the footprint; in between the two are blended. Both
//! are partitions of unity, so neither the blend nor the place changes the flux.
//!
//! **Validity.** A pixel counts as seen if its four corners have a direction. Texels that see only part of
//! that have a covered fraction below 1, and a value that is the mean over the seen part.
//!
//! **Cost**, on one core: a 186° fish-eye of 1024² to an octahedral map of 512² takes 0.7 s to build (0.3 s of it the
//! solid angles of the source's pixels) and 7 ms to apply to RGB; it has 2.0 million entries of 8 bytes. To 256²:
//! 0.45 s, 1.4 million entries. A camera of 640×480 to a pinhole of that size: 0.6 s, 2.5 million entries.

mod clip;
mod outline;

use std::collections::HashMap;

use nalgebra::Vector2;
use rayon::prelude::*;

use crate::pixel::RasterPx;
use crate::raster::Raster;
use clip::{Clipper, Moments, Polygon, moments};
use outline::{Edge, Quad, Sample, Tracer};

/// Texel rows that one task works off; neighbouring rows share their edges.
const BAND_ROWS: u32 = 16;
/// Footprints up to this many source pixels are interpolated between pixel centres.
const TENT_UP_TO_PX2: f64 = 0.25;
/// Footprints from this many source pixels on average pixels as squares.
const BOX_FROM_PX2: f64 = 1.0;
/// From the corner of a pixel to its centre.
const HALF: Vector2<f64> = Vector2::new(0.5, 0.5);
/// Smaller covered fractions count as no data.
const MIN_COVERED: f64 = 1e-6;

/// Why a table cannot be made or applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RemapError {
    /// The table would not fit 32-bit offsets.
    #[error(
        "the remap table would have {entries} entries, more than 32-bit offsets can count: use smaller images"
    )]
    TooManyEntries {
        /// Source pixels over all texels.
        entries: usize,
    },
    /// An image does not fit the table.
    #[error(
        "the {image} image has {found} values, the table needs {needed} ({channels} channels × {width} × {height} pixels)"
    )]
    Length {
        /// `source` or `destination`.
        image: &'static str,
        /// Values given.
        found: usize,
        /// Values needed.
        needed: usize,
        /// Values per pixel.
        channels: usize,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
}

/// A sparse matrix that takes images of one raster to another, in compressed rows, as it is uploaded to a GPU.
#[derive(Clone, Debug, PartialEq)]
pub struct RemapTable {
    source_size_px: [u32; 2],
    destination_size_px: [u32; 2],
    offsets: Vec<u32>,
    indices: Vec<u32>,
    weights: Vec<f32>,
    covered: Vec<f32>,
}

impl RemapTable {
    /// Builds the table from `source` to `destination`, which share a frame, on all cores of the current rayon pool.
    ///
    /// # Errors
    /// More than 2³² entries.
    pub fn build(source: &Raster, destination: &Raster) -> Result<Self, RemapError> {
        let builder = Builder::new(source, destination);
        let [width, height] = destination.size_px();
        let bands = (0..height.div_ceil(BAND_ROWS))
            .into_par_iter()
            .map(|band| builder.band(band * BAND_ROWS..((band + 1) * BAND_ROWS).min(height)))
            .collect::<Vec<_>>();
        let entries = bands.iter().map(|band| band.indices.len()).sum::<usize>();
        if u32::try_from(entries).is_err() {
            return Err(RemapError::TooManyEntries { entries });
        }
        let texels = width as usize * height as usize;
        let mut table = Self {
            source_size_px: source.size_px(),
            destination_size_px: destination.size_px(),
            offsets: Vec::with_capacity(texels + 1),
            indices: Vec::with_capacity(entries),
            weights: Vec::with_capacity(entries),
            covered: Vec::with_capacity(texels),
        };
        table.offsets.push(0);
        let mut end = 0;
        for band in bands {
            table.offsets.extend(band.counts.iter().map(|count| {
                end += count;
                end
            }));
            table.indices.extend(band.indices);
            table.weights.extend(band.weights);
            table.covered.extend(band.covered);
        }
        Ok(table)
    }

    /// Width and height of the source images, in pixels.
    pub fn source_size_px(&self) -> [u32; 2] {
        self.source_size_px
    }

    /// Width and height of the destination images, in pixels.
    pub fn destination_size_px(&self) -> [u32; 2] {
        self.destination_size_px
    }

    /// Where each destination texel's entries begin, row by row, and one offset more: the end.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// Source pixel of each entry, y·width + x, ascending within a texel.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Weight of each entry, more than 0. Over a texel that has entries they sum to exactly 1.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The fraction, 0 to 1, of each destination texel's solid angle that the source sees; 0 = no data, no entries.
    pub fn covered(&self) -> &[f32] {
        &self.covered
    }

    /// The entries of texel `index` (row by row): source pixels and weights; empty beyond the end.
    pub fn entries(&self, index: usize) -> impl Iterator<Item = (u32, f32)> {
        let range = match self.offsets.get(index..index.saturating_add(2)) {
            Some(&[begin, end]) => begin as usize..end as usize,
            _ => 0..0,
        };
        let indices = self.indices.get(range.clone()).unwrap_or_default();
        let weights = self.weights.get(range).unwrap_or_default();
        indices.iter().copied().zip(weights.iter().copied())
    }

    /// Takes an image with `CHANNELS` interleaved linear values per pixel to the destination raster, on all cores of
    /// the current rayon pool. Texels without data become 0. A constant image stays constant to the last bit. A NaN
    /// or infinity spoils the texels that see it, and no other.
    ///
    /// # Errors
    /// A slice whose length does not fit.
    pub fn apply<const CHANNELS: usize>(
        &self,
        source: &[f32],
        destination: &mut [f32],
    ) -> Result<(), RemapError> {
        check_length::<CHANNELS>("source", source.len(), self.source_size_px)?;
        check_length::<CHANNELS>("destination", destination.len(), self.destination_size_px)?;
        let (source, _) = source.as_chunks::<CHANNELS>();
        let (destination, _) = destination.as_chunks_mut::<CHANNELS>();
        let width = self.destination_size_px[0] as usize;
        destination.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let mut sum = [0.0_f64; CHANNELS];
                for (index, weight) in self.entries(y * width + x) {
                    let Some(value) = source.get(index as usize) else {
                        continue;
                    };
                    for (sum, value) in sum.iter_mut().zip(value) {
                        *sum += f64::from(weight) * f64::from(*value);
                    }
                }
                *pixel = sum.map(|sum| sum as f32);
            }
        });
        Ok(())
    }
}

fn check_length<const CHANNELS: usize>(
    image: &'static str,
    found: usize,
    [width, height]: [u32; 2],
) -> Result<(), RemapError> {
    const { assert!(CHANNELS > 0) };
    let needed = CHANNELS * width as usize * height as usize;
    if found == needed {
        return Ok(());
    }
    Err(RemapError::Length { image, found, needed, channels: CHANNELS, width, height })
}

/// The entries of some rows of texels.
#[derive(Default)]
struct Band {
    counts: Vec<u32>,
    indices: Vec<u32>,
    weights: Vec<f32>,
    covered: Vec<f32>,
}

struct Builder<'a> {
    tracer: Tracer<'a>,
    source_sr: Vec<f64>,
    destination_sr: Vec<f64>,
    /// Source pixels by the texel their centre falls into; only filled where a texel may swallow the whole source.
    swallowed: HashMap<u32, Vec<u32>>,
}

/// What one texel collects.
#[derive(Default)]
struct Collector {
    clipper: Clipper,
    /// Cuts pieces that `clipper` has cut, where the source's seen part ends.
    border: Clipper,
    shifted: Polygon,
    /// Source pixel and solid angle, in any order, with repetitions.
    entries: Vec<(u32, f64)>,
    /// Some of the footprint lies outside of what the source sees.
    partial: bool,
}

impl<'a> Builder<'a> {
    fn new(source: &'a Raster, destination: &'a Raster) -> Self {
        let (source_sr, destination_sr) = (source.solid_angles_sr(), destination.solid_angles_sr());
        let seen_sr = source_sr.iter().sum::<f64>();
        let widest_sr = destination_sr.iter().copied().fold(0.0, f64::max);
        let swallowed = if widest_sr * 64.0 > seen_sr && !source.is_whole_sphere() {
            pixels_by_texel(source, destination, &source_sr)
        } else {
            HashMap::new()
        };
        Self { tracer: Tracer { destination, source }, source_sr, destination_sr, swallowed }
    }

    fn band(&self, rows: std::ops::Range<u32>) -> Band {
        let [width, _] = self.tracer.destination.size_px();
        let corners = |y: u32| -> Vec<Sample> {
            (0..=width).map(|x| self.tracer.sample(Vector2::new(f64::from(x), f64::from(y)))).collect()
        };
        let horizontal = |row: &[Sample]| -> Vec<Edge> {
            row.windows(2).map(|w| self.tracer.edge(&w[0], &w[1])).collect()
        };
        let mut band = Band::default();
        let mut collector = Collector::default();
        let mut top = corners(rows.start);
        let mut top_edges = horizontal(&top);
        for y in rows {
            let bottom = corners(y + 1);
            let bottom_edges = horizontal(&bottom);
            let vertical: Vec<Edge> = top.iter().zip(&bottom).map(|(a, b)| self.tracer.edge(a, b)).collect();
            for x in 0..width as usize {
                let quad = Quad {
                    corners: [top[x], top[x + 1], bottom[x], bottom[x + 1]],
                    edges: [&top_edges[x], &bottom_edges[x], &vertical[x], &vertical[x + 1]],
                };
                self.texel(y * width + x as u32, &quad, &mut collector);
                collector.finish(self.destination_sr[(y * width) as usize + x], &mut band);
            }
            (top, top_edges) = (bottom, bottom_edges);
        }
        band
    }

    fn texel(&self, index: u32, quad: &Quad, collector: &mut Collector) {
        let texel_sr = self.destination_sr[index as usize];
        if texel_sr <= 0.0 || !quad.corners.iter().all(Sample::has_direction) {
            return;
        }
        let seen = self.tracer.trace(quad, texel_sr, 0, &mut |polygon, whole| {
            collector.partial |= !whole;
            self.add(polygon, texel_sr, collector);
        });
        collector.partial |= !seen;
        if let (false, Some(pixels)) = (seen, self.swallowed.get(&index)) {
            collector.entries.extend(pixels.iter().map(|&pixel| (pixel, self.source_sr[pixel as usize])));
        }
    }

    /// Adds the source pixels under a polygon, which is part of a texel of `texel_sr`.
    fn add(&self, polygon: &mut Polygon, texel_sr: f64, collector: &mut Collector) {
        let source = self.tracer.source;
        if !source.is_whole_sphere() {
            collector.partial |= collector.clipper.clip_to_image(polygon, source.size_px());
        }
        let Some(&inside) = polygon.first() else { return };
        let area = moments(polygon, inside).area;
        if area == 0.0 {
            return;
        }
        let centroid = polygon.iter().sum::<Vector2<f64>>() / polygon.len() as f64;
        let pixel = source.pixel_index(centroid.x.floor() as i64, centroid.y.floor() as i64);
        // The size of the whole texel in source pixels, also if this polygon is only a part of it.
        let footprint_px2 = texel_sr / self.source_sr[pixel as usize];
        let box_share = if footprint_px2.is_finite() { box_share(footprint_px2) } else { 1.0 };
        if box_share > 0.0 {
            self.add_box(polygon, box_share * area.signum(), collector);
        }
        if box_share < 1.0 {
            self.add_tent(polygon, (1.0 - box_share) * area.signum(), collector);
        }
    }

    /// Source pixels as squares. Within a pixel the density of solid angle changes linearly, so that parts of a pixel
    /// get their own share and all parts together the pixel's solid angle.
    fn add_box(&self, polygon: &[Vector2<f64>], factor: f64, collector: &mut Collector) {
        let source = self.tracer.source;
        let Collector { clipper, entries, partial, .. } = collector;
        clipper.for_each_cell(polygon, |x, y, piece| {
            let index = source.pixel_index(x, y);
            let pixel_sr = self.source_sr[index as usize];
            if pixel_sr <= 0.0 {
                *partial = true;
                return;
            }
            let about_center = moments(piece, Vector2::new(x as f64, y as f64) + HALF);
            let at = |x: i64, y: i64| {
                let sr = self.source_sr[source.pixel_index(x, y) as usize];
                if sr > 0.0 { sr } else { pixel_sr }
            };
            let slope = Vector2::new(at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1)) / 2.0;
            let overlap_sr =
                pixel_sr * about_center.area + slope.x * about_center.x + slope.y * about_center.y;
            entries.push((index, overlap_sr * factor));
        });
    }

    /// The source interpolated linearly between pixel centres: the polygon is cut at the grid of centres, and each
    /// piece shared out between the four pixels around it. Where one of them is not seen, its share goes to the pixel
    /// whose square the place is in: the squares seen are filled to their edge, and nothing beyond.
    fn add_tent(&self, polygon: &[Vector2<f64>], factor: f64, collector: &mut Collector) {
        let source = self.tracer.source;
        let Collector { clipper, border, shifted, entries, partial } = collector;
        shifted.clear();
        shifted.extend(polygon.iter().map(|p| p - HALF));
        clipper.for_each_cell(shifted, |x, y, piece| {
            let around =
                [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| source.pixel_index(x, y));
            let corner = Vector2::new(x as f64, y as f64);
            let seen = |index: u32| self.source_sr[index as usize] > 0.0;
            let mut add = |shares: [f64; 4], instead: u32| {
                for (index, share) in around.into_iter().zip(shares) {
                    let index = if seen(index) { index } else { instead };
                    entries.push((index, self.source_sr[index as usize] * share * factor));
                }
            };
            if around.iter().all(|index| seen(*index)) {
                add(tent_shares(moments(piece, corner)), around[0]);
                return;
            }
            let piece: Polygon = piece.iter().map(|p| p + HALF).collect();
            border.for_each_cell(&piece, |x, y, part| {
                let own = source.pixel_index(x, y);
                if seen(own) {
                    add(tent_shares(moments(part, corner + HALF)), own);
                } else {
                    *partial = true;
                }
            });
        });
    }
}

/// What the pixels at (0,0), (1,0), (0,1), (1,1) get of a piece with moments about (0,0): the integrals of
/// (1−x)(1−y), x(1−y), (1−x)y and xy.
fn tent_shares(m: Moments) -> [f64; 4] {
    [m.area - m.x - m.y + m.xy, m.x - m.xy, m.y - m.xy, m.xy]
}

/// How much of a footprint of this size is averaged in squares: 0 to 1, smoothly.
fn box_share(footprint_px2: f64) -> f64 {
    let t = ((footprint_px2 - TENT_UP_TO_PX2) / (BOX_FROM_PX2 - TENT_UP_TO_PX2)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The pixels of `source` by the texel of `destination` that their centre falls into.
fn pixels_by_texel(source: &Raster, destination: &Raster, source_sr: &[f64]) -> HashMap<u32, Vec<u32>> {
    let ([width, _], [columns, rows]) = (source.size_px(), destination.size_px());
    let mut by_texel: HashMap<u32, Vec<u32>> = HashMap::new();
    for (index, _) in (0_u32..).zip(source_sr).filter(|(_, sr)| **sr > 0.0) {
        let center = RasterPx::center_of(index % width, index / width);
        let place = source.direction(center).and_then(|d| destination.position(&d));
        if let Some(RasterPx(place)) = place {
            // Whole-sphere maps are closed at 1; images are not, but there the border is nobody's texel.
            let inside = place.x >= 0.0
                && place.y >= 0.0
                && place.x <= f64::from(columns)
                && place.y <= f64::from(rows);
            if inside {
                let texel = destination.pixel_index(place.x as i64, place.y as i64);
                by_texel.entry(texel).or_default().push(index);
            }
        }
    }
    by_texel
}

impl Collector {
    /// Moves what was collected for one texel of `texel_sr` to the end of `band`.
    fn finish(&mut self, texel_sr: f64, band: &mut Band) {
        self.entries.sort_unstable_by_key(|(index, _)| *index);
        self.entries.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 += next.1;
            }
            same
        });
        self.entries.retain(|(_, sr)| *sr > 0.0);
        let total_sr = self.entries.iter().map(|(_, sr)| sr).sum::<f64>();
        let covered = if total_sr > 0.0 { (total_sr / texel_sr).min(1.0) } else { 0.0 };
        let begin = band.indices.len();
        if covered > MIN_COVERED {
            push_weights(&self.entries, total_sr, band);
            band.covered.push(if self.partial { covered as f32 } else { 1.0 });
        } else {
            band.covered.push(0.0);
        }
        band.counts.push((band.indices.len() - begin) as u32);
        self.entries.clear();
        self.partial = false;
    }
}

/// Weights as whole multiples of a power of two, so that they, and any constant times them, add up without rounding.
/// The running sum is rounded, not the weights: no error piles up.
fn push_weights(entries: &[(u32, f64)], total_sr: f64, band: &mut Band) {
    let largest = entries.iter().map(|(_, sr)| sr / total_sr).fold(0.0, f64::max);
    let steps_per_unit = 2_f64.powi(22 - largest.log2().ceil() as i32);
    let (mut sum, mut done) = (0.0, 0.0);
    for (i, (index, sr)) in entries.iter().enumerate() {
        sum += sr / total_sr;
        let last = i + 1 == entries.len();
        let up_to = if last { steps_per_unit } else { (sum * steps_per_unit).round().min(steps_per_unit) };
        if up_to > done {
            band.indices.push(*index);
            band.weights.push(((up_to - done) / steps_per_unit) as f32);
            done = up_to;
        }
    }
}
