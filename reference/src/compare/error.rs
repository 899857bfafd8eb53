use coshade_image_file::ImageError;

/// Why two images cannot be compared. Every message names both.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A file could not be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The images differ in size.
    #[error("{a} is {a_px} px and {b} is {b_px} px: only images of one size can be compared", a_px = size(*.a_px), b_px = size(*.b_px))]
    Size {
        /// First image.
        a: String,
        /// Its width and height.
        a_px: [usize; 2],
        /// Second image.
        b: String,
        /// Its width and height.
        b_px: [usize; 2],
    },
    /// The images cover different pixels of their display windows.
    #[error(
        "{a} begins at pixel {a_origin_px:?} and {b} at {b_origin_px:?}: their data windows must be the same"
    )]
    Window {
        /// First image.
        a: String,
        /// Upper left pixel of its data window.
        a_origin_px: [i32; 2],
        /// Second image.
        b: String,
        /// Upper left pixel of its data window.
        b_origin_px: [i32; 2],
    },
    /// The images have different channels.
    #[error("{a} has channels {a_channels} and {b} has {b_channels}: name layers that match")]
    Channels {
        /// First image.
        a: String,
        /// Its channels.
        a_channels: String,
        /// Second image.
        b: String,
        /// Its channels.
        b_channels: String,
    },
    /// The coverage layer does not say for every pixel how much of it is virtual.
    #[error("{coverage}: not a coverage layer: {reason}")]
    Coverage {
        /// The layer.
        coverage: String,
        /// What is wrong with it.
        reason: String,
    },
    /// An option is out of its range.
    #[error("{option} = {value}: {expected}")]
    Option {
        /// Its name.
        option: &'static str,
        /// What was given.
        value: String,
        /// What is accepted.
        expected: &'static str,
    },
    /// A FLIP picture was asked for, of something that is not shown on a display.
    #[error("no FLIP picture of {a} and {b}: channels {channels} are data, not colour")]
    NotColour {
        /// First image.
        a: String,
        /// Second image.
        b: String,
        /// Their channels.
        channels: String,
    },
    /// The camera response given is no response.
    #[error("the camera response gives NaN for radiance {radiance} in channel {channel}")]
    Response {
        /// Channel 0, 1 or 2.
        channel: usize,
        /// Input.
        radiance: f32,
    },
}

fn size([width, height]: [usize; 2]) -> String {
    format!("{width}x{height}")
}
