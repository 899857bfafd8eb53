//! DWA-compressed blocks say how much each of their sections unpacks to, and exr 1.74 allocates what they say. Here
//! these counters are held against the size of the block before it is decoded.

use std::io::Cursor;

use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::reader::ChunksReader;
use exr::compression::Compression;
use exr::error::{Error, Result};
use exr::meta::header::Header;

/// Of the eleven counters (64 bits each) that begin a block, the sizes are those after the version and before the coder.
const SIZES: std::ops::Range<usize> = 1..10;
/// Side of the blocks of the cosine transform, to whose multiples a section is padded.
const DCT_SIDE_PX: usize = 8;

/// Fails if a DWA block claims sections that no block of its size has.
pub(super) fn check_sections(bytes: &[u8]) -> Result<()> {
    let reader = exr::block::read(Cursor::new(bytes), false)?;
    let is_dwa = |header: &Header| matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_));
    if !reader.headers().iter().any(is_dwa) {
        return Ok(());
    }
    let chunks = reader.filter_chunks(false, |_, _, _| true)?;
    let headers = chunks.meta_data().headers.clone();
    for chunk in chunks {
        let chunk = chunk?;
        match headers.get(chunk.layer_index) {
            Some(header) if is_dwa(header) => check_chunk(header, &chunk)?,
            _ => {}
        }
    }
    Ok(())
}

fn check_chunk(header: &Header, chunk: &Chunk) -> Result<()> {
    let data = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    let indices = header.get_block_data_indices(&chunk.compressed_block)?;
    let size = header.get_absolute_block_pixel_coordinates(indices)?.size;
    let bytes_per_pixel = header.channels.bytes_per_pixel;
    if data.len() == size.area() * bytes_per_pixel {
        return Ok(()); // stored raw, without counters
    }
    let padded = |side: usize| (side + DCT_SIDE_PX) as u64;
    // Twice: run-length coding may lengthen what it cannot shorten.
    let most = 2 * padded(size.width()) * padded(size.height()) * bytes_per_pixel as u64;
    let counters = data.chunks_exact(8).take(SIZES.end).skip(SIZES.start);
    let values = counters.filter_map(|counter| Some(u64::from_le_bytes(counter.try_into().ok()?)));
    match values.max() {
        Some(largest) if largest > most => Err(Error::Invalid("DWA section larger than its block".into())),
        _ => Ok(()),
    }
}
