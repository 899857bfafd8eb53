//! A mailbox for one value that the sender overwrites: a slow reader sees the newest, never a queue.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TrySendError, bounded};
use crossbeam_queue::ArrayQueue;

use crate::clock::now;

/// An empty mailbox: the end to put values into, and the end to take them from.
///
/// Neither end takes a lock. To feed several readers, send an `Arc` (or a [`Frame`](crate::Frame), which shares its
/// pixels) into one mailbox for each.
pub fn latest<T>() -> (LatestSender<T>, LatestReceiver<T>) {
    let slot = Arc::new(Slot { value: ArrayQueue::new(1), overwritten: AtomicU64::new(0) });
    let (wake, woken) = bounded(1);
    (LatestSender { slot: Arc::clone(&slot), wake }, LatestReceiver { slot, woken })
}

struct Slot<T> {
    value: ArrayQueue<T>,
    overwritten: AtomicU64,
}

/// The end of a mailbox that values are put into. Dropping it closes the mailbox.
pub struct LatestSender<T> {
    slot: Arc<Slot<T>>,
    /// Carries one token while a value may be unread.
    wake: Sender<()>,
}

impl<T> LatestSender<T> {
    /// Puts `value` in, in the place of one not yet read. Never blocks.
    ///
    /// # Errors
    /// [`ReaderGone`] if nobody can read it any more.
    pub fn send(&self, value: T) -> Result<(), ReaderGone> {
        if self.slot.value.force_push(value).is_some() {
            self.slot.overwritten.fetch_add(1, Ordering::Relaxed);
        }
        // The token goes in after the value: whoever takes the token finds the value, or a receiver before it did.
        match self.wake.try_send(()) {
            Ok(()) | Err(TrySendError::Full(())) => Ok(()),
            Err(TrySendError::Disconnected(())) => Err(ReaderGone),
        }
    }

    /// How many values were overwritten unread.
    pub fn overwritten(&self) -> u64 {
        self.slot.overwritten.load(Ordering::Relaxed)
    }
}

/// The one end of a mailbox that values are taken from.
pub struct LatestReceiver<T> {
    slot: Arc<Slot<T>>,
    woken: Receiver<()>,
}

impl<T> LatestReceiver<T> {
    /// Takes the newest value, waiting at most `timeout` for one.
    ///
    /// # Errors
    /// [`LatestError::Timeout`], or [`LatestError::Closed`] once the sender is gone and its last value was taken.
    pub fn receive(&mut self, timeout: Duration) -> Result<T, LatestError> {
        let deadline = now() + timeout;
        loop {
            // First the token, then the value: a value sent after this look leaves a token for the next one.
            let closed = match self.woken.recv_timeout(deadline.saturating_since(now())) {
                Ok(()) => None,
                Err(RecvTimeoutError::Timeout) => Some(LatestError::Timeout),
                Err(RecvTimeoutError::Disconnected) => Some(LatestError::Closed),
            };
            match (self.slot.value.pop(), closed) {
                (Some(value), _) => return Ok(value),
                (None, Some(error)) => return Err(error),
                // The token was of a value that an earlier look had taken already.
                (None, None) => {}
            }
        }
    }

    /// Takes the newest value if there is one.
    pub fn take(&mut self) -> Option<T> {
        self.slot.value.pop()
    }

    /// How many values were overwritten unread.
    pub fn overwritten(&self) -> u64 {
        self.slot.overwritten.load(Ordering::Relaxed)
    }
}

/// Why [`LatestReceiver::receive`] has no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LatestError {
    /// None came in time.
    #[error("nothing came in the time allowed")]
    Timeout,
    /// The sender is gone and its last value was taken.
    #[error("the sender is gone")]
    Closed,
}

/// The reader of a mailbox is gone: what is sent would never be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the reader is gone")]
pub struct ReaderGone;
