//! Putting the shards of a picture together.

use thiserror::Error;

use super::{Film, FilmPixel};

/// Most parts of a job.
pub const MAX_SHARDS: u32 = 1 << 16;

/// Which part of which job a film is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShardMark {
    /// From 0.
    pub index: u32,
    /// How many parts there are.
    pub count: u32,
    /// Names the job: a hash of scene, camera and settings.
    pub key: u64,
}

/// Why films cannot be merged.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MergeError {
    /// There is nothing.
    #[error("no shards to merge")]
    Nothing,
    /// A whole picture among the parts.
    #[error("picture {0} is not a shard: it has no layer \"shard\", or a broken one")]
    NotAShard(usize),
    /// Parts of another job.
    #[error(
        "picture {0} is a shard of another job than picture 1: scene, camera, size, seed or settings differ"
    )]
    OtherJob(usize),
    /// The same part twice.
    #[error("shard {index}/{count} is there twice")]
    Twice {
        /// From 1.
        index: u32,
        /// How many there are.
        count: u32,
    },
    /// Parts are missing.
    #[error("of {count} shards {missing:?} are missing")]
    Missing {
        /// From 1.
        missing: Vec<u32>,
        /// How many there are.
        count: u32,
    },
}

impl ShardMark {
    /// Floats hold whole numbers of 24 bits.
    const BITS: u32 = 24;

    pub(super) fn to_floats(self) -> [f32; 4] {
        let part = |shift: u32| ((self.key >> shift) & ((1 << Self::BITS) - 1)) as f32;
        [self.index as f32, self.count as f32, part(0), part(Self::BITS)]
    }

    pub(super) fn from_floats([index, count, key_0, key_1]: [f32; 4]) -> Self {
        Self { index: index as u32, count: count as u32, key: key_0 as u64 | (key_1 as u64) << Self::BITS }
    }

    /// Cuts a hash down to what the file holds.
    pub fn key_of(hash: u64) -> u64 {
        hash & ((1 << (2 * Self::BITS)) - 1)
    }
}

/// Merges all shards of a job, in any order: the picture is the one that an unsharded job makes, to the last bit, if all
/// took the same number of samples.
///
/// # Errors
/// [`MergeError`] where the parts do not belong together, or are not all there. Pictures are counted from 1.
pub fn merge(films: &[Film]) -> Result<Film, MergeError> {
    let first = films.first().ok_or(MergeError::Nothing)?;
    let mark = first.shard.ok_or(MergeError::NotAShard(1))?;
    if mark.count > MAX_SHARDS {
        return Err(MergeError::NotAShard(1));
    }
    let mut there = vec![false; mark.count.min(films.len() as u32) as usize];
    let mut pixels = vec![FilmPixel::default(); first.pixels.len()];
    for (number, film) in (1..).zip(films) {
        let shard = film.shard.ok_or(MergeError::NotAShard(number))?;
        let same_job = shard.key == mark.key
            && shard.count == mark.count
            && shard.index < shard.count
            && film.size_px == first.size_px
            && film.depth_is_range == first.depth_is_range;
        if !same_job {
            return Err(MergeError::OtherJob(number));
        }
        let index = shard.index as usize;
        there.resize(there.len().max(index + 1), false);
        if std::mem::replace(&mut there[index], true) {
            return Err(MergeError::Twice { index: shard.index + 1, count: shard.count });
        }
        for (pixel, part) in pixels.iter_mut().zip(&film.pixels) {
            if part.samples > 0 {
                *pixel = *part;
            }
        }
    }
    let missing: Vec<u32> = (0..mark.count)
        .filter(|&index| !there.get(index as usize).copied().unwrap_or(false))
        .map(|index| index + 1)
        .collect();
    if !missing.is_empty() {
        return Err(MergeError::Missing { missing, count: mark.count });
    }
    let rejected_samples = films.iter().map(|film| film.rejected_samples).sum();
    Ok(Film { pixels, shard: None, rejected_samples, ..first.clone() })
}
