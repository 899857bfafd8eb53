//! Pixel memory that goes back to where it came from.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crossbeam_queue::ArrayQueue;

/// A fixed number of pixel buffers that are used again and again.
///
/// A clone hands out of the same buffers. Nothing here blocks: an empty pool refuses and counts.
#[derive(Clone)]
pub struct FramePool {
    shelf: Arc<Shelf>,
}

struct Shelf {
    free: ArrayQueue<Vec<u8>>,
    dropped: AtomicU64,
}

impl FramePool {
    /// A pool of `count` buffers (at least one) of `capacity_bytes` each.
    ///
    /// `capacity_bytes` may be 0: a buffer grows to the largest frame it has ever held and keeps that size.
    pub fn new(count: usize, capacity_bytes: usize) -> Self {
        let free = ArrayQueue::new(count.max(1));
        while free.push(vec![0; capacity_bytes]).is_ok() {}
        Self { shelf: Arc::new(Shelf { free, dropped: AtomicU64::new(0) }) }
    }

    /// A buffer of `len` bytes to be filled, or `None` (counted as a dropped frame) if all are in use.
    ///
    /// The bytes hold what the last user left there.
    pub fn acquire(&self, len: usize) -> Option<PixelBufferMut> {
        let Some(mut bytes) = self.shelf.free.pop() else {
            self.shelf.dropped.fetch_add(1, Ordering::Relaxed);
            return None;
        };
        if bytes.len() < len {
            // The bytes need not survive: a fresh vector spares copying them.
            bytes = vec![0; len];
        }
        Some(PixelBufferMut(Storage { bytes, len, home: Some(Arc::clone(&self.shelf)) }))
    }

    /// How often [`acquire`](Self::acquire) found the pool empty.
    pub fn dropped(&self) -> u64 {
        self.shelf.dropped.load(Ordering::Relaxed)
    }

    /// Buffers that could be acquired now.
    pub fn available(&self) -> usize {
        self.shelf.free.len()
    }
}

impl fmt::Debug for FramePool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FramePool({} of {} free)", self.available(), self.shelf.free.capacity())
    }
}

/// Bytes, how many of them count, and the pool they go back to.
struct Storage {
    /// Kept at its full length, so that a smaller frame in between does not cost zeroing later.
    bytes: Vec<u8>,
    len: usize,
    home: Option<Arc<Shelf>>,
}

impl Storage {
    fn used(&self) -> &[u8] {
        self.bytes.get(..self.len).unwrap_or(&self.bytes)
    }
}

impl Drop for Storage {
    fn drop(&mut self) {
        if let Some(home) = self.home.take() {
            // The shelf has room for every buffer it ever gave out; were it full, the memory would just be freed.
            let _ = home.free.push(std::mem::take(&mut self.bytes));
        }
    }
}

/// A buffer being filled by its one owner; dropped unfilled, it goes back to its pool.
pub struct PixelBufferMut(Storage);

impl PixelBufferMut {
    /// A buffer that belongs to no pool.
    pub fn from_vec(bytes: Vec<u8>) -> Self {
        let len = bytes.len();
        Self(Storage { bytes, len, home: None })
    }

    /// Shortens the buffer to `len` bytes; no effect if it is not longer.
    pub fn truncate(&mut self, len: usize) {
        self.0.len = self.0.len.min(len);
    }

    /// Ends the filling: from now on the bytes can be shared and no longer change.
    pub fn freeze(self) -> PixelBuffer {
        PixelBuffer(Arc::new(self.0))
    }
}

impl Deref for PixelBufferMut {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.0.used()
    }
}

impl DerefMut for PixelBufferMut {
    fn deref_mut(&mut self) -> &mut [u8] {
        let len = self.0.len.min(self.0.bytes.len());
        &mut self.0.bytes[..len]
    }
}

impl fmt::Debug for PixelBufferMut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PixelBufferMut({} bytes)", self.len())
    }
}

/// The bytes of a frame: immutable, shared by clones, back in the pool when the last clone is dropped.
#[derive(Clone)]
pub struct PixelBuffer(Arc<Storage>);

impl PixelBuffer {
    /// A buffer that belongs to no pool, for sources that have none.
    pub fn from_vec(bytes: Vec<u8>) -> Self {
        PixelBufferMut::from_vec(bytes).freeze()
    }
}

impl From<Vec<u8>> for PixelBuffer {
    fn from(bytes: Vec<u8>) -> Self {
        Self::from_vec(bytes)
    }
}

impl Deref for PixelBuffer {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.0.used()
    }
}

impl PartialEq for PixelBuffer {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl fmt::Debug for PixelBuffer {
    /// The number of bytes, not the bytes: a frame has millions.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PixelBuffer({} bytes)", self.len())
    }
}
