//! What a slow reader gets: the newest value, or every value.

use std::time::Duration;

use coshade_capture::{LatestError, LatestReceiver, LatestSender, latest};
use crossbeam_channel::{Receiver, RecvTimeoutError, SendTimeoutError, Sender, bounded};

use super::{POLL, Shared};

/// Values that may wait between a writer and a reader where none may be lost: none, for what waits is late. The writer holds
/// the next one ready while the reader works.
const QUEUE: usize = 0;

/// What a slow reader gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handover {
    /// The newest value; those it did not take are overwritten and counted. The writer never waits.
    Newest,
    /// Every value, in order; the writer waits for it.
    Every,
}

/// An empty handover.
pub fn channel<T>(kind: Handover) -> (Outlet<T>, Inlet<T>) {
    match kind {
        Handover::Newest => {
            let (sender, receiver) = latest();
            (Outlet::Newest(sender), Inlet::Newest(receiver))
        }
        Handover::Every => {
            let (sender, receiver) = bounded(QUEUE);
            (Outlet::Every(sender), Inlet::Every(receiver))
        }
    }
}

/// Where values go in. Dropping it ends the handover, behind the values already in it.
pub enum Outlet<T> {
    /// See [`Handover::Newest`].
    Newest(LatestSender<T>),
    /// See [`Handover::Every`].
    Every(Sender<T>),
}

impl<T> Outlet<T> {
    /// Puts a value in. `false` if nobody will take it: the reader is gone, or the pipeline was stopped while its queue was
    /// full.
    pub fn send(&self, mut value: T, shared: &Shared) -> bool {
        let sender = match self {
            Self::Newest(sender) => return sender.send(value).is_ok(),
            Self::Every(sender) => sender,
        };
        loop {
            value = match sender.send_timeout(value, POLL) {
                Ok(()) => return true,
                Err(SendTimeoutError::Disconnected(_)) => return false,
                Err(SendTimeoutError::Timeout(_)) if shared.stopped() => return false,
                Err(SendTimeoutError::Timeout(value)) => value,
            };
        }
    }
}

/// Where values come out.
pub enum Inlet<T> {
    /// See [`Handover::Newest`].
    Newest(LatestReceiver<T>),
    /// See [`Handover::Every`].
    Every(Receiver<T>),
}

impl<T> Inlet<T> {
    /// Takes a value, waiting at most `timeout` for one.
    ///
    /// # Errors
    /// [`LatestError::Timeout`], or [`LatestError::Closed`] once the writer is gone and its last value was taken.
    pub fn receive(&mut self, timeout: Duration) -> Result<T, LatestError> {
        match self {
            Self::Newest(receiver) => receiver.receive(timeout),
            Self::Every(receiver) => receiver.recv_timeout(timeout).map_err(|error| match error {
                RecvTimeoutError::Timeout => LatestError::Timeout,
                RecvTimeoutError::Disconnected => LatestError::Closed,
            }),
        }
    }

    /// How many values were overwritten unread.
    pub fn overwritten(&self) -> u64 {
        match self {
            Self::Newest(receiver) => receiver.overwritten(),
            Self::Every(_) => 0,
        }
    }
}
