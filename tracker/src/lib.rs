//! AprilTags: what they look like, and boards of them.
//!
//! | module | what is there |
//! | --- | --- |
//! | [`family`] | the tag families |
//! | [`bitmap`] | black and white cells of a tag |
//! | [`board`] | the board file: tags printed on one sheet |

pub mod bitmap;
pub mod board;
pub mod family;

pub use bitmap::{TagBitmap, TagError, tag_bitmap};
pub use board::{Board, BoardTag};
pub use family::Family;
