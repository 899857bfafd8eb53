//! The name of an image source, as written in a session: `v4l:/dev/video0`, `replay:desk.mcap#camera`.

use std::fmt;
use std::str::FromStr;

/// Kinds of source there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SourceScheme {
    /// A Video4Linux device.
    V4l,
    /// A camera through the `nokhwa` library, by number or name.
    Nokhwa,
    /// A recording.
    Replay,
    /// Image files.
    Images,
    /// A simulated camera.
    Sim,
}

impl SourceScheme {
    /// All of them, each with an example.
    pub const ALL: [(Self, &'static str, &'static str); 5] = [
        (Self::V4l, "v4l", "v4l:/dev/video0"),
        (Self::Nokhwa, "nokhwa", "nokhwa:0"),
        (Self::Replay, "replay", "replay:desk.mcap#camera"),
        (Self::Images, "images", "images:photos/*.png"),
        (Self::Sim, "sim", "sim:desk.toml#camera"),
    ];

    fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known, _)| *known == name).map(|&(scheme, ..)| scheme)
    }

    /// The word before the colon.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|&&(scheme, ..)| scheme == self).map_or("", |&(_, name, _)| name)
    }

    fn example(self) -> &'static str {
        Self::ALL.iter().find(|&&(scheme, ..)| scheme == self).map_or("", |&(.., example)| example)
    }

    /// True if what follows the scheme is the name of a device that only one reader can open.
    pub fn is_device(self) -> bool {
        matches!(self, Self::V4l | Self::Nokhwa)
    }

    /// True if the source brings its own calibration along.
    pub fn brings_calibration(self) -> bool {
        matches!(self, Self::Replay | Self::Sim)
    }
}

/// A source taken apart: `scheme:path#fragment?query`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct SourceUri {
    /// The kind of source.
    pub scheme: SourceScheme,
    /// Device, file, folder or glob pattern.
    pub path: String,
    /// Behind `#`: the stream of a recording, the camera of a simulated world.
    pub fragment: Option<String>,
    /// Behind `?`: options of the source, as they are.
    pub query: Option<String>,
}

/// Why a text names no source.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SourceError {
    /// Nothing before a colon.
    #[error("`{0}` does not say what kind of source it is; write for example {examples}", examples = examples())]
    NoScheme(String),
    /// A word before the colon that is not known.
    #[error("unknown kind of source `{0}`; known are {examples}", examples = examples())]
    UnknownScheme(String),
    /// Nothing behind the colon.
    #[error("`{0}:` does not say which one; write for example `{1}`")]
    NoPath(&'static str, &'static str),
    /// A `#` or `?` with nothing behind it.
    #[error("nothing behind `{0}`")]
    Empty(char),
    /// The simulated camera has no name.
    #[error("`sim:` does not say which camera of the world; write for example `sim:desk.toml#camera`")]
    NoCamera,
}

fn examples() -> String {
    SourceScheme::ALL.map(|(.., example)| format!("`{example}`")).join(", ")
}

impl FromStr for SourceUri {
    type Err = SourceError;

    fn from_str(text: &str) -> Result<Self, SourceError> {
        let (name, rest) = text.split_once(':').ok_or_else(|| SourceError::NoScheme(text.to_owned()))?;
        let scheme = SourceScheme::named(name).ok_or_else(|| SourceError::UnknownScheme(name.to_owned()))?;
        // `?` is also a wildcard of glob patterns: options are what has an equals sign.
        let (rest, query) = match rest.rsplit_once('?') {
            Some((_, "")) if scheme != SourceScheme::Images => return Err(SourceError::Empty('?')),
            Some((rest, query)) if query.contains('=') => (rest, Some(query.to_owned())),
            _ => (rest, None),
        };
        let has_parts = matches!(scheme, SourceScheme::Replay | SourceScheme::Sim);
        let (path, fragment) = match rest.rsplit_once('#').filter(|_| has_parts) {
            Some((_, "")) => return Err(SourceError::Empty('#')),
            Some((path, fragment)) => (path, Some(fragment.to_owned())),
            None => (rest, None),
        };
        if path.is_empty() {
            return Err(SourceError::NoPath(scheme.name(), scheme.example()));
        }
        if scheme == SourceScheme::Sim && fragment.is_none() {
            return Err(SourceError::NoCamera);
        }
        Ok(Self { scheme, path: path.to_owned(), fragment, query })
    }
}

impl fmt::Display for SourceUri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.scheme.name(), self.path)?;
        if let Some(fragment) = &self.fragment {
            write!(f, "#{fragment}")?;
        }
        if let Some(query) = &self.query {
            write!(f, "?{query}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scheme_is_taken_apart_and_put_together_again() {
        let parts = |text: &str| {
            let source: SourceUri = text.parse().unwrap();
            assert_eq!(source.to_string(), text);
            (source.scheme, source.path, source.fragment, source.query)
        };
        let some = |text: &str| Some(text.to_owned());
        assert_eq!(parts("v4l:/dev/video0"), (SourceScheme::V4l, "/dev/video0".to_owned(), None, None));
        assert_eq!(parts("nokhwa:0"), (SourceScheme::Nokhwa, "0".to_owned(), None, None));
        assert_eq!(
            parts("replay:a b.mcap#camera?rate=2&loop=true"),
            (SourceScheme::Replay, "a b.mcap".to_owned(), some("camera"), some("rate=2&loop=true"))
        );
        assert_eq!(parts("replay:desk.mcap"), (SourceScheme::Replay, "desk.mcap".to_owned(), None, None));
        // A glob pattern may contain what means something elsewhere.
        assert_eq!(
            parts("images:p#1/img?.png?fps=10"),
            (SourceScheme::Images, "p#1/img?.png".to_owned(), None, some("fps=10"))
        );
        assert_eq!(parts("images:img?.png"), (SourceScheme::Images, "img?.png".to_owned(), None, None));
        assert_eq!(
            parts("sim:desk.toml#eye"),
            (SourceScheme::Sim, "desk.toml".to_owned(), some("eye"), None)
        );
    }

    #[test]
    fn mistakes_say_what_to_write() {
        let message = |text: &str| text.parse::<SourceUri>().unwrap_err().to_string();
        assert!(message("/dev/video0").contains("`v4l:/dev/video0`"));
        let unknown = message("v4l2:/dev/video0");
        for scheme in ["`v4l2`", "v4l:", "nokhwa:", "replay:", "images:", "sim:"] {
            assert!(unknown.contains(scheme), "{unknown}");
        }
        assert!(message("replay:").contains("replay:desk.mcap#camera"));
        assert!(message("replay:desk.mcap#").contains("nothing behind `#`"));
        assert!(message("v4l:/dev/video0?").contains("nothing behind `?`"));
        assert!(message("sim:desk.toml").contains("which camera"));
        assert!(message("").contains("does not say"));
    }
}
