//! How tags are looked for.

use crate::family::Family;

/// How the AprilTag library looks for tags.
#[derive(Clone, Debug, PartialEq)]
pub struct DetectorSettings {
    /// Families that are looked for, each once. More: slower, and more that can be mistaken.
    pub families: Vec<Family>,
    /// Outlines are looked for in an image this many times smaller: 1, 1.5 or a whole number up to 16; bits are read from the
    /// whole one. Higher: faster. Lower: smaller tags are found; about 20 px times this.
    pub decimate: f32,
    /// Threads, 1 to 64. One is the caller's own; more are started with the first image and wait for the next. Higher: images
    /// of megapixels are done sooner, at more work altogether.
    pub threads: u32,
    /// Standard deviation of a blur before outlines are looked for, in px of the smaller image, −8 to 8; negative numbers
    /// sharpen. Higher: less disturbed by noise, small tags are lost. Lower: the other way round. Between −0.5 and 0.5: as it is.
    pub blur_px: f32,
    /// Move the edges of outlines to the steepest place near them, in the whole image. True: more exact, above all with
    /// `decimate`. False: faster.
    pub refine_edges: bool,
    /// Sharpening when bits are read, 0 to 4. Higher: smaller tags can be read. Lower: less disturbed by noise.
    pub decode_sharpening: f64,
    /// Wrong bits that are corrected, 0 to 2. Higher: more tags are read, and more that are none.
    pub max_hamming: u32,
    /// Outlines of fewer pixels are none, 1 to 10⁶. Higher: faster, small tags are lost.
    pub min_cluster_pixels: u32,
    /// White must be this much brighter than black, in codes, 0 to 255. Higher: faster, tags of low contrast are lost. `None`:
    /// so much that noise alone is not searched for tags.
    pub min_white_black_diff: Option<u32>,
}

impl Default for DetectorSettings {
    fn default() -> Self {
        Self {
            families: vec![Family::Tag36h11],
            decimate: 1.0,
            threads: 1,
            blur_px: 0.0,
            refine_edges: true,
            decode_sharpening: 0.25,
            max_hamming: 2,
            min_cluster_pixels: 5,
            min_white_black_diff: None,
        }
    }
}

/// Why there is no detector.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DetectorError {
    /// A setting is out of its range.
    #[error("{name} = {value} is out of range: {range}")]
    Range {
        /// The setting.
        name: &'static str,
        /// What it was set to.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// No family, or one of them twice.
    #[error("families: {0}")]
    Families(String),
    /// A table of all codes with wrong bits would not fit the memory.
    #[error(
        "{family} with {max_hamming} corrected bits needs a table of {megabytes} MB, more than {} MB are refused: set \
         max_hamming to {}",
        MAX_TABLE_BYTES / 1_000_000, max_hamming.saturating_sub(1)
    )]
    Table {
        /// The family.
        family: Family,
        /// Bits to be corrected.
        max_hamming: u32,
        /// Size of the table.
        megabytes: u64,
    },
    /// The library could not allocate.
    #[error("the AprilTag library has no memory")]
    Memory,
    /// The threads could not be started.
    #[error("the system did not start {threads} threads for the AprilTag library: set fewer threads")]
    Threads {
        /// How many there should have been.
        threads: u32,
    },
    /// The image is too large.
    #[error(
        "an image of {width_px} x {height_px} pixels, searched at decimate = {decimate}: no side may be longer than 16384 \
         pixels, and no more than 8192 x 8192 pixels are searched: set decimate higher, or scale the image down"
    )]
    Image {
        /// Width in pixels.
        width_px: u32,
        /// Height in pixels.
        height_px: u32,
        /// How many times smaller it would have been searched.
        decimate: f32,
    },
}

/// Larger tables of codes are refused: tagCircle49h12 with two wrong bits would need 7.6 GB.
const MAX_TABLE_BYTES: u64 = 500_000_000;

impl DetectorSettings {
    pub(super) fn check(&self) -> Result<(), DetectorError> {
        let range = |name, value: f64, low: f64, high: f64, range| match (low..=high).contains(&value) {
            true => Ok(()),
            false => Err(DetectorError::Range { name, value, range }),
        };
        // Other numbers: the library shrinks by the whole number below, and stretches what it finds by the number itself.
        let allowed =
            |decimate: f32| decimate == 1.5 || decimate.fract() == 0.0 && (1.0..=16.0).contains(&decimate);
        if !allowed(self.decimate) {
            let (value, range) = (f64::from(self.decimate), "1, 1.5 or a whole number up to 16");
            return Err(DetectorError::Range { name: "decimate", value, range });
        }
        range("threads", f64::from(self.threads), 1.0, 64.0, "1 to 64")?;
        range("blur_px", f64::from(self.blur_px), -8.0, 8.0, "-8 to 8")?;
        range("decode_sharpening", self.decode_sharpening, 0.0, 4.0, "0 to 4")?;
        range("max_hamming", f64::from(self.max_hamming), 0.0, 2.0, "0 to 2")?;
        range("min_cluster_pixels", f64::from(self.min_cluster_pixels), 1.0, 1e6, "1 to 1000000")?;
        range(
            "min_white_black_diff",
            f64::from(self.min_white_black_diff.unwrap_or(0)),
            0.0,
            255.0,
            "0 to 255",
        )?;
        if self.families.is_empty() {
            return Err(DetectorError::Families("none is given".into()));
        }
        let mut families = self.families.clone();
        families.sort_unstable();
        if let Some(pair) = families.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(DetectorError::Families(format!("{} is given twice", pair[0])));
        }
        Ok(())
    }

    /// Whether the table of a family's codes, right and with wrong bits, is of a size that can be allocated.
    pub(super) fn check_table(&self, family: Family, bits: u32) -> Result<(), DetectorError> {
        let (bits, max_hamming) = (u64::from(bits), self.max_hamming);
        let codes = 1
            + if max_hamming >= 1 { bits } else { 0 }
            + if max_hamming >= 2 { bits * (bits - 1) } else { 0 };
        // The library keeps two thirds of its entries of 16 bytes free.
        let bytes = u64::from(family.tag_count()) * codes * 3 * 16;
        match bytes > MAX_TABLE_BYTES {
            true => Err(DetectorError::Table { family, max_hamming, megabytes: bytes / 1_000_000 }),
            false => Ok(()),
        }
    }
}
