//! The board file: tags that are fixed to each other, on one sheet or in space. `docs/board.md` lists its keys.

mod mistake;
mod pose;

use std::path::Path;

use coshade_config::{Document, Error, Problem};
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::body::{Body, BodyTag};
use crate::detection::TagId;
use crate::family::Family;
pub use mistake::BoardMistake;

/// The version of the file's keys that this program reads and writes.
pub const VERSION: u32 = 1;

/// Corners closer to one plane than this share of the board's extent are on it.
const FLATNESS: f64 = 1e-6;

/// Tags that are fixed to each other: a printed sheet, a thing with tags on its faces, or a room with tags on its walls.
/// A sheet's frame: x right, y up along the print, z out of the paper, origin at its centre. The frame of other things is
/// arbitrary; tags are placed in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Board {
    /// Version of this format.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Family of the tags.
    pub family: Family,
    /// The tags.
    #[serde(rename = "tag")]
    #[schemars(length(min = 1, max = 4096))]
    pub tags: Vec<BoardTag>,
    /// How the numbers came about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<BoardProvenance>,
}

/// One tag of a board, and where it is. Its own frame: x right, y up along the print, z out of the paper, origin at its
/// centre. At most one of `rotation_deg` and `quaternion_xyzw` is given; without any it is upright as the board is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoardTag {
    /// Number within the family.
    pub id: u32,
    /// Its family, if it is not the board's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<Family>,
    /// Side of the square through its four detected corners (tag36h11: outer edge of the black border).
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 100.0))]
    pub size_m: f64,
    /// Its centre in the board's frame: x and y, or x, y and z.
    #[schemars(length(min = 2, max = 3), inner(range(min = -10000.0, max = 10000.0)))]
    pub position_m: Vec<f64>,
    /// Turned about the board's x axis first, then about its y, then about its z axis: R = Rz·Ry·Rx (Blender's "XYZ
    /// Euler").
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_deg: Option<[f64; 3]>,
    /// Unit quaternion from the tag's to the board's frame, real part last. Normalised if its length is within 1 ± 0.001.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion_xyzw: Option<[f64; 4]>,
}

/// How a board was printed or measured. Nothing here changes what is computed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoardProvenance {
    /// Program and version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<String>,
    /// Date and time, such as "2026-03-01T14:05:00Z" (RFC 3339, in quotes).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<String>,
    /// Images or recordings it was measured in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub images: Vec<String>,
    /// Root mean square distance between detected and reprojected corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub rms_px: Option<f64>,
    /// Anything else worth knowing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notes: Option<String>,
}

impl Board {
    /// Reads a board file.
    ///
    /// # Errors
    /// [`Error::Invalid`] with all problems at once, each with its place; other variants if it cannot be read.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::read(path)?)
    }

    /// As [`Board::read`] from a text; `path` is the file that messages name.
    ///
    /// # Errors
    /// As [`Board::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::parse(text, path)?)
    }

    /// Writes a board file, whole or not at all; one that is there already is replaced.
    ///
    /// # Errors
    /// [`Error::Unwritable`] for a value such as NaN, [`Error::Invalid`] for one that could not be read again,
    /// [`Error::Write`].
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let mut document = Document::new(self, path)?;
        Self::consistent(document.clone())?;
        document.save_as(path)
    }

    fn consistent(document: Document<Self>) -> Result<Self, Error> {
        let problem = |mistake: BoardMistake| document.error_at(mistake.key, mistake.message, mistake.help);
        let problems: Vec<Problem> = document.value().mistakes().into_iter().map(problem).collect();
        Document::<Self>::reject(problems)?;
        Ok(document.into_value())
    }

    /// The name of one of its tags.
    pub fn tag_id(&self, tag: &BoardTag) -> TagId {
        TagId { family: tag.family.unwrap_or(self.family), id: tag.id }
    }

    /// The families that its tags are of, each once, in the order of [`Family::ALL`].
    pub fn families(&self) -> Vec<Family> {
        let used = |family: &Family| self.tags.iter().any(|tag| self.tag_id(tag).family == *family);
        Family::ALL.into_iter().filter(used).collect()
    }

    /// The tags in their places.
    ///
    /// # Errors
    /// The first of [`Board::mistakes`], of which a board that was read has none.
    pub fn placed_tags(&self) -> Result<Vec<BodyTag>, BoardMistake> {
        if let Some(mistake) = self.mistakes().into_iter().next() {
            return Err(mistake);
        }
        let placed = |(index, tag): (usize, &BoardTag)| {
            let body_from_tag = tag.board_from_tag().map_err(|mistake| mistake.of_tag(index))?;
            Ok(BodyTag { tag: self.tag_id(tag), size_m: tag.size_m, body_from_tag })
        };
        self.tags.iter().enumerate().map(placed).collect()
    }

    /// The smallest and largest coordinates of the tags' corners, in the board's frame.
    ///
    /// # Errors
    /// As [`Board::placed_tags`].
    pub fn extent_m(&self) -> Result<[Point3<f64>; 2], BoardMistake> {
        let corners = self.placed_tags()?.into_iter().flat_map(|tag| tag.corners_m());
        let nothing = [Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3])];
        Ok(corners.fold(nothing, |[low, high], corner| [low.inf(&corner), high.sup(&corner)]))
    }

    /// Whether all tags are on one plane and face the same way: what one sheet can hold.
    ///
    /// # Errors
    /// As [`Board::placed_tags`].
    pub fn is_flat(&self) -> Result<bool, BoardMistake> {
        let tags = self.placed_tags()?;
        let [low, high] = self.extent_m()?;
        let Some(first) = tags.first() else { return Ok(true) };
        let first_from_body = first.body_from_tag.inverse();
        let normal = |tag: &BodyTag| tag.body_from_tag * nalgebra::Vector3::z();
        let on_plane =
            |corner: Point3<f64>| (first_from_body * corner).z.abs() <= FLATNESS * (high - low).norm();
        Ok(tags
            .iter()
            .all(|tag| normal(tag).dot(&normal(first)) > 0.0 && tag.corners_m().into_iter().all(on_plane)))
    }
}

impl Body {
    /// The tags of a board, in the board's frame.
    ///
    /// # Errors
    /// As [`Board::placed_tags`]: nothing that a board file can hold.
    pub fn from_board(name: impl Into<String>, board: &Board) -> Result<Self, BoardMistake> {
        Ok(Self { name: name.into(), tags: board.placed_tags()? })
    }
}

#[cfg(test)]
mod tests;
