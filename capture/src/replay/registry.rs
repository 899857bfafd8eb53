//! Which recordings are being played in this process: source strings that name the same file share a clock.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::options::ReplayOptions;
use super::playback::{Playback, Shared};

struct Entry {
    shared: Weak<Shared>,
    /// As a source string gave them.
    options: Option<ReplayOptions>,
}

static PLAYING: Mutex<BTreeMap<PathBuf, Entry>> = Mutex::new(BTreeMap::new());

/// The playing of the file `path`, begun if no camera has it open.
///
/// Options are of the file, not of a stream: one source string gives them, or all that do agree.
pub(super) fn playback(path: &Path, options: Option<ReplayOptions>) -> Result<Playback, String> {
    let file = path.canonicalize().map_err(|error| format!("{}: cannot be read: {error}", path.display()))?;
    let mut playing = PLAYING.lock().unwrap_or_else(PoisonError::into_inner);
    playing.retain(|_, entry| entry.shared.strong_count() > 0);
    if let Some(entry) = playing.get_mut(&file)
        && let Some(shared) = entry.shared.upgrade()
    {
        let playback = Playback::from_shared(shared);
        match (options, entry.options) {
            (Some(new), Some(old)) if new != old => {
                return Err(
                    "is being played with other options; give the same to all its streams, or to one only"
                        .into(),
                );
            }
            (Some(new), None) => {
                playback.set_rate(new.rate);
                playback.set_looping(new.looping);
                playback.seek(new.start);
                entry.options = Some(new);
            }
            _ => {}
        }
        return Ok(playback);
    }
    let playback = Playback::open(path, options.unwrap_or_default()).map_err(|error| error.to_string())?;
    playing.insert(file, Entry { shared: Arc::downgrade(playback.shared()), options });
    Ok(playback)
}
