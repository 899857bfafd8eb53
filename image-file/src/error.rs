use std::path::{Path, PathBuf};

/// Why an image could not be read, written or built. Every message names the file.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The operating system refused.
    #[error("{path}: cannot be read: {source}", path = path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The first bytes belong to no format that is read here.
    #[error("{path}: not an image in a known format (EXR, Radiance HDR, PNG, JPEG), but {found}", path = path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// What was there instead.
        found: String,
    },
    /// The file is broken.
    #[error("{path}: broken {part}: {reason}", path = path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// The part that is broken: a format's name or `header`.
        part: &'static str,
        /// What the decoder said.
        reason: String,
    },
    /// The file is sound, but uses something that is not read here.
    #[error("{path}: {what}", path = path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What it uses, and what to do about it.
        what: String,
    },
    /// The header asks for more than [`crate::ReadLimits`] allows.
    #[error(
        "{path}: {width}x{height} px with {channels} channels is over the read limit \
         ({limit_side_px} px a side, {limit_bytes} bytes of decoded samples)",
        path = path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Claimed width in pixels.
        width: usize,
        /// Claimed height in pixels.
        height: usize,
        /// Claimed number of channels.
        channels: usize,
        /// [`crate::ReadLimits::max_decoded_bytes`].
        limit_bytes: u64,
        /// [`crate::ReadLimits::max_side_px`].
        limit_side_px: usize,
    },
    /// A layer was asked for that the file does not have, or none was and there is a choice.
    #[error("{path}: {problem}; it has: {available}", path = path.display())]
    Layer {
        /// The file.
        path: PathBuf,
        /// `no layer "x"`, or that one must be named.
        problem: String,
        /// The layers it has, with their channels.
        available: String,
    },
    /// An image cannot be written as asked.
    #[error("{path}: cannot be written: {reason}", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why not, and what to do.
        reason: String,
    },
    /// Samples and size do not fit each other.
    #[error("no image can be made: {0}")]
    Shape(String),
}

impl ImageError {
    /// The message without the file's name in front, for callers that name the file themselves.
    pub fn reason(&self) -> String {
        let message = self.to_string();
        let path = match self {
            Self::Open { path, .. }
            | Self::UnknownFormat { path, .. }
            | Self::Decode { path, .. }
            | Self::Unsupported { path, .. }
            | Self::TooLarge { path, .. }
            | Self::Layer { path, .. }
            | Self::Write { path, .. } => path,
            Self::Shape(_) => return message,
        };
        let reason = message.strip_prefix(&format!("{}: ", path.display())).map(str::to_owned);
        reason.unwrap_or(message)
    }

    pub(crate) fn decode(path: &Path, part: &'static str, reason: impl ToString) -> Self {
        Self::Decode { path: path.into(), part, reason: reason.to_string() }
    }

    pub(crate) fn unsupported(path: &Path, what: impl Into<String>) -> Self {
        Self::Unsupported { path: path.into(), what: what.into() }
    }

    pub(crate) fn write(path: &Path, reason: impl ToString) -> Self {
        Self::Write { path: path.into(), reason: reason.to_string() }
    }
}
