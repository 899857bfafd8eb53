//! What a job is told.

use std::str::FromStr;
use std::time::Duration;

use thiserror::Error;

use super::JobError;
use crate::film::MAX_SHARDS;
use crate::integrator::Settings;

/// How a picture is rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct JobOptions {
    /// Samples per pixel, at least 1. Higher: less noise (it falls with the square root), slower.
    pub samples: u32,
    /// No further pass begins after this; the first one always ends.
    pub time_limit: Option<Duration>,
    /// Ends when the standard error is at most this share of the difference, both as root mean squares over the film (of
    /// the mixed world where the worlds do not differ). Looked at from 16 samples on.
    pub error_limit: Option<f64>,
    /// Which paths, and how far.
    pub settings: Settings,
    /// Another seed is an independent picture.
    pub seed: u32,
    /// Which tiles.
    pub shard: Shard,
    /// 0: one for each processor.
    pub threads: usize,
    /// Photons of each pass. Left out: a quarter of the pixels, at least 20 000, at most a million. Higher: smoother
    /// caustics, slower.
    pub photons_per_pass: Option<u32>,
    /// Radius in which photons are gathered in the first pass, metres. Left out: 1/200 of the scene's. Higher: smoother
    /// caustics, sharp only after many passes. Lower: grainier ones, sharp sooner.
    pub photon_radius_m: Option<f32>,
}

impl Default for JobOptions {
    fn default() -> Self {
        Self {
            samples: 64,
            time_limit: None,
            error_limit: None,
            settings: Settings::default(),
            seed: 0,
            shard: Shard::default(),
            threads: 0,
            photons_per_pass: None,
            photon_radius_m: None,
        }
    }
}

impl JobOptions {
    /// First radius of photons by that of the scene.
    pub(super) const RADIUS_SHARE: f32 = 1.0 / 200.0;

    pub(super) fn default_photons(width: u32, height: u32) -> u32 {
        let quarter = u64::from(width) * u64::from(height) / 4;
        quarter.clamp(20_000, 1_000_000) as u32
    }

    pub(super) fn check(&self) -> Result<(), JobError> {
        let fail = |option, value: String, expected| Err(JobError::Option { option, value, expected });
        if !(1..=1 << 24).contains(&self.samples) {
            return fail("samples", self.samples.to_string(), "1 to 16777216");
        }
        if let Some(limit) = self.error_limit.filter(|limit| !(limit.is_finite() && *limit > 0.0)) {
            return fail("error_limit", limit.to_string(), "a share above 0");
        }
        if self.threads > 4096 {
            return fail("threads", self.threads.to_string(), "0 (all processors) to 4096");
        }
        let radius = self.photon_radius_m.filter(|radius| !(radius.is_finite() && *radius > 0.0));
        if let Some(radius) = radius {
            return fail("photon_radius_m", radius.to_string(), "a length above 0");
        }
        if self.photons_per_pass == Some(0) {
            return fail("photons_per_pass", "0".to_owned(), "at least 1");
        }
        if self.settings.max_depth > 10_000 {
            return fail("max_depth", self.settings.max_depth.to_string(), "0 to 10000");
        }
        if self.shard.count == 0 || self.shard.index >= self.shard.count || self.shard.count > MAX_SHARDS {
            return fail("shard", self.shard.to_string(), "i/n with 1 <= i <= n <= 65536");
        }
        Ok(())
    }
}

/// One part of a job: every `count`-th tile, from tile `index` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: u32,
    /// How many parts there are; 1: the whole picture.
    pub count: u32,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, count: 1 }
    }
}

/// Not a shard.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("'{0}' is not a shard; expected i/n with 1 <= i <= n <= 65536, such as 2/8")]
pub struct ShardError(String);

impl FromStr for Shard {
    type Err = ShardError;

    /// `i/n`, i from 1.
    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parse = || {
            let (index, count) = text.split_once('/')?;
            let (index, count): (u32, u32) = (index.trim().parse().ok()?, count.trim().parse().ok()?);
            (1 <= index && index <= count && count <= MAX_SHARDS).then(|| Self { index: index - 1, count })
        };
        parse().ok_or_else(|| ShardError(text.to_owned()))
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", u64::from(self.index) + 1, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_counted_from_one() {
        let shard: Shard = "2/8".parse().unwrap();
        assert_eq!(shard, Shard { index: 1, count: 8 });
        assert_eq!(shard.to_string(), "2/8");
        for bad in ["0/8", "9/8", "8", "/", "1/0", "-1/3", "1/99999999", "a/b", ""] {
            let message = bad.parse::<Shard>().unwrap_err().to_string();
            assert!(message.contains(&format!("'{bad}'")), "{message}");
        }
    }

    #[test]
    fn options_that_make_no_sense_are_named() {
        let sane = JobOptions::default();
        assert!(sane.check().is_ok());
        let shard = Shard { index: 3, count: 3 };
        let settings = Settings { max_depth: u32::MAX, ..sane.settings };
        let cases = [
            ("samples", JobOptions { samples: 0, ..sane.clone() }),
            ("samples", JobOptions { samples: u32::MAX, ..sane.clone() }),
            ("error_limit", JobOptions { error_limit: Some(f64::NAN), ..sane.clone() }),
            ("error_limit", JobOptions { error_limit: Some(0.0), ..sane.clone() }),
            ("threads", JobOptions { threads: usize::MAX, ..sane.clone() }),
            ("photon_radius_m", JobOptions { photon_radius_m: Some(-1.0), ..sane.clone() }),
            ("photons_per_pass", JobOptions { photons_per_pass: Some(0), ..sane.clone() }),
            ("max_depth", JobOptions { settings, ..sane.clone() }),
            ("shard = 4/3", JobOptions { shard, ..sane.clone() }),
        ];
        for (name, options) in cases {
            let message = options.check().unwrap_err().to_string();
            assert!(message.starts_with(name), "{message}");
        }
    }
}
