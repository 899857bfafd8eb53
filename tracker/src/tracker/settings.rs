//! How a tracker works.

use std::time::Duration;

use crate::detector::DetectorSettings;
use crate::refine::RefineSettings;

/// How a tracker works.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackerSettings {
    /// How tags are found.
    pub detector: DetectorSettings,
    /// How the corners of tags just found are refined.
    pub refine: RefineSettings,
    /// Look for tags only where they should be, and in the whole image now and then.
    pub regions: bool,
    /// With `regions`: pixels that are looked at on all tags together that are followed, at least 250 on each. Higher: more
    /// exact. Lower: faster.
    pub follow_pixels: usize,
    /// With `regions`: time from one search of the whole image to the next while a tag is missing that was in view in the last
    /// seconds, in an image twice smaller. Higher: less work. Lower: it is found again sooner.
    pub search_for_lost_every: Duration,
    /// With `regions`: the same while none is missing, in an image four times smaller. Higher: less work. Lower: what is new in
    /// view is found sooner.
    pub search_for_new_every: Duration,
    /// With `regions`: the same for a search as careful as the detector's settings say. Higher: less work. Lower: small tags
    /// that are new in view are found sooner.
    pub search_thoroughly_every: Duration,
    /// Take jitter out of poses.
    pub filter: bool,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self {
            detector: DetectorSettings::default(),
            refine: RefineSettings::default(),
            regions: true,
            follow_pixels: 1000,
            search_for_lost_every: Duration::from_millis(150),
            search_for_new_every: Duration::from_millis(500),
            search_thoroughly_every: Duration::from_secs(10),
            filter: true,
        }
    }
}
