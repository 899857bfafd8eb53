use glam::Vec3;

use super::ImageError;

/// One named plane of samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// `R`, `G`, `B`, `A`, `Y`, `Z`, `X`, …; without the layer's name.
    pub name: String,
    /// One `f32` per pixel: row by row from the top, each from the left.
    pub samples: Vec<f32>,
}

/// Where an EXR's pixels sit: data window and display window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Upper left pixel of the stored rectangle (x right, y down), in the file's pixel coordinates.
    pub data_origin_px: [i32; 2],
    /// Upper left pixel of the rectangle that is meant to be seen.
    pub display_origin_px: [i32; 2],
    /// Size of the rectangle that is meant to be seen.
    pub display_size_px: [usize; 2],
}

/// What the channels of an image mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourKind {
    /// Has `R`, `G` and `B`.
    Rgb,
    /// Has `Y` and no colour.
    Grey,
    /// Anything else: depth, normals, identifiers.
    Data,
}

/// Counts of samples that are not ordinary radiance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SampleCensus {
    /// Samples that are not a number.
    pub nan: u64,
    /// Samples that are infinite, of either sign.
    pub infinite: u64,
    /// Finite samples below zero.
    pub negative: u64,
}

/// A float image of named channels, all of the same size; at least 1×1 with one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    channels: Vec<Channel>,
    window: Option<Window>,
}

impl Image {
    /// An image of `width` × `height` px from named planes.
    ///
    /// # Errors
    /// No pixels, no channels, a plane of another length, or a name twice.
    pub fn new(width: usize, height: usize, channels: Vec<Channel>) -> Result<Self, ImageError> {
        let pixels = width.checked_mul(height).filter(|&count| count > 0);
        let (Some(pixels), false) = (pixels, channels.is_empty()) else {
            let count = channels.len();
            return Err(ImageError::Shape(format!("{width}x{height} px with {count} channels")));
        };
        for (index, channel) in channels.iter().enumerate() {
            let (name, length) = (&channel.name, channel.samples.len());
            if length != pixels {
                let size = format!("{width}x{height} px = {pixels}");
                return Err(ImageError::Shape(format!("channel {name:?} has {length} samples, not {size}")));
            }
            if channels.iter().take(index).any(|earlier| earlier.name == *name) {
                return Err(ImageError::Shape(format!("channel {name:?} is there twice")));
            }
        }
        Ok(Self { width, height, channels, window: None })
    }

    /// A colour image from one linear RGB value per pixel, row by row.
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn from_rgb(width: usize, height: usize, pixels: &[Vec3]) -> Result<Self, ImageError> {
        Self::from_vectors(width, height, pixels, ["R", "G", "B"])
    }

    /// An image of vectors (normals, positions) with channels `X`, `Y`, `Z`.
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn from_xyz(width: usize, height: usize, vectors: &[Vec3]) -> Result<Self, ImageError> {
        Self::from_vectors(width, height, vectors, ["X", "Y", "Z"])
    }

    /// An image of one channel: `Y` for brightness and coverage, `Z` for depth.
    ///
    /// # Errors
    /// As [`Image::new`].
    pub fn from_plane(
        width: usize,
        height: usize,
        name: &str,
        samples: Vec<f32>,
    ) -> Result<Self, ImageError> {
        Self::new(width, height, vec![Channel { name: name.into(), samples }])
    }

    fn from_vectors(
        width: usize,
        height: usize,
        vectors: &[Vec3],
        names: [&str; 3],
    ) -> Result<Self, ImageError> {
        let plane = |axis: usize| vectors.iter().map(|vector| vector[axis]).collect();
        let channels = names
            .into_iter()
            .enumerate()
            .map(|(axis, name)| Channel { name: name.into(), samples: plane(axis) });
        Self::new(width, height, channels.collect())
    }

    pub(crate) fn with_window(mut self, window: Window) -> Self {
        self.window = Some(window);
        self
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All channels: `R G B A`, `X Y Z` or alphabetical.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Where the pixels sat in the EXR they came from; `None` for other formats and images made here.
    pub fn window(&self) -> Option<Window> {
        self.window
    }

    /// The samples of a channel, by its exact name.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|channel| channel.name == name).map(|channel| channel.samples.as_slice())
    }

    /// The names of all channels.
    pub fn channel_names(&self) -> Vec<&str> {
        self.channels.iter().map(|channel| channel.name.as_str()).collect()
    }

    /// The planes `R`, `G`, `B`, if it has all three.
    pub fn rgb(&self) -> Option<[&[f32]; 3]> {
        Some([self.channel("R")?, self.channel("G")?, self.channel("B")?])
    }

    /// What the channels mean, by their names.
    pub fn colour_kind(&self) -> ColourKind {
        let others = |name: &&str| !matches!(*name, "Y" | "A");
        if self.rgb().is_some() {
            ColourKind::Rgb
        } else if self.channel("Y").is_some() && !self.channel_names().iter().any(others) {
            ColourKind::Grey
        } else {
            ColourKind::Data
        }
    }

    /// Counts samples of all channels that are NaN, infinite or negative.
    pub fn census(&self) -> SampleCensus {
        let mut census = SampleCensus::default();
        for sample in self.channels.iter().flat_map(|channel| &channel.samples) {
            census.nan += u64::from(sample.is_nan());
            census.infinite += u64::from(sample.is_infinite());
            census.negative += u64::from(sample.is_finite() && *sample < 0.0);
        }
        census
    }

    /// Sorts channels into the customary order: `R G B A`, then the others by name.
    pub(crate) fn sort_channels<T>(channels: &mut [T], name: impl Fn(&T) -> &str) {
        let rank = |name: &str| "RGBA".find(name).filter(|_| name.len() == 1).unwrap_or(4);
        channels.sort_by(|a, b| (rank(name(a)), name(a)).cmp(&(rank(name(b)), name(b))));
    }
}

/// A named image of a [`LayeredImage`].
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// `real`, `depth_z_m`, `ViewLayer.Combined`, …; empty for channels without a prefix.
    pub name: String,
    /// Its pixels.
    pub image: Image,
}

/// What a file holds: named layers, each of its own size and channels.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayeredImage {
    /// In the file's order; names differ.
    pub layers: Vec<Layer>,
    /// What a reader of figures should know: NaNs, ignored profiles, rounded integers.
    pub notes: Vec<String>,
}

impl LayeredImage {
    /// A file with one unnamed layer.
    pub fn single(image: Image) -> Self {
        Self { layers: vec![Layer { name: String::new(), image }], notes: Vec::new() }
    }

    /// Adds a layer.
    ///
    /// # Errors
    /// The name is taken.
    pub fn push(&mut self, name: &str, image: Image) -> Result<(), ImageError> {
        if self.layer(name).is_some() {
            return Err(ImageError::Shape(format!("layer {name:?} is there twice")));
        }
        self.layers.push(Layer { name: name.into(), image });
        Ok(())
    }

    /// The layer of that exact name.
    pub fn layer(&self, name: &str) -> Option<&Image> {
        self.layers.iter().find(|layer| layer.name == name).map(|layer| &layer.image)
    }

    /// Adds a note for each layer that holds NaNs or infinities.
    pub(crate) fn note_non_finite(&mut self) {
        for layer in &self.layers {
            let census = layer.image.census();
            if census.nan + census.infinite > 0 {
                let place =
                    if layer.name.is_empty() { "image".into() } else { format!("layer {:?}", layer.name) };
                let (nan, infinite) = (census.nan, census.infinite);
                self.notes.push(format!("{place}: {nan} NaN and {infinite} infinite samples kept"));
            }
        }
    }
}
