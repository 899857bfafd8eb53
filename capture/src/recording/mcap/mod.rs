//! Reads MCAP files (<https://mcap.dev/spec>), also cut and damaged ones.
//!
//! Own code instead of the `mcap` crate's readers, which stop at the first damage, and which take the lengths in a
//! file for granted (an attachment that is too short for its own checksum makes them panic).

mod file;
mod record;
mod scan;
mod summary;

pub(crate) use file::McapFile;
pub(crate) use record::MAGIC;
