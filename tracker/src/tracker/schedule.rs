//! When the whole image is searched, and how carefully.

use std::time::Duration;

use coshade_capture::Timestamp;

use super::follow::Trail;
use super::{TrackerSettings, Tracking};
use crate::luma::Luma;

/// A tag that was seen so shortly ago was in the last frame or the one before.
const LAST_FRAME: Duration = Duration::from_millis(120);
/// Searches for tags that are lost, and for new ones, are made in images so many times smaller.
const DECIMATE_FOR_LOST: u32 = 2;
const DECIMATE_FOR_NEW: u32 = 4;

/// When what was last done.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Schedule {
    newest: Option<Timestamp>,
    search: Option<Timestamp>,
    thorough: Option<Timestamp>,
}

impl Schedule {
    /// Takes note of an image. False if it is older than the last one: another sequence has begun.
    pub(super) fn goes_on(&mut self, captured: Timestamp) -> bool {
        self.newest.replace(captured).is_none_or(|newest| captured >= newest)
    }

    /// The next image is searched as the first one was.
    pub(super) fn start_anew(&mut self) {
        (self.search, self.thorough) = (None, None);
    }

    /// Whether the whole image is to be searched now, and how many times smaller, beside what was seen in it already.
    pub(super) fn due(
        &mut self,
        settings: &TrackerSettings,
        trails: &[Trail],
        image: &Luma,
        captured: Timestamp,
        seen: &Tracking,
    ) -> Option<u32> {
        let decimate = self.wanted(settings, trails, image, captured, seen)?;
        self.search = Some(captured);
        if decimate == 1 {
            self.thorough = Some(captured);
        }
        Some(decimate)
    }

    fn wanted(
        &self,
        settings: &TrackerSettings,
        trails: &[Trail],
        image: &Luma,
        captured: Timestamp,
        seen: &Tracking,
    ) -> Option<u32> {
        let is_over =
            |last: Option<Timestamp>, every| last.is_none_or(|last| captured.saturating_since(last) >= every);
        if !settings.regions || is_over(self.thorough, settings.search_thoroughly_every) {
            return Some(1);
        }
        let nothing = seen.tags.is_empty();
        let all_at_once = nothing && trails.iter().any(|trail| trail.was_in(captured, LAST_FRAME));
        let is_missing = |trail: &Trail| !seen.has(trail.tag()) && trail.should_be_in(image, captured);
        let (every, decimate) = match nothing || trails.iter().any(is_missing) {
            true => (settings.search_for_lost_every, DECIMATE_FOR_LOST),
            false => (settings.search_for_new_every, DECIMATE_FOR_NEW),
        };
        (all_at_once || is_over(self.search, every)).then_some(decimate)
    }
}
