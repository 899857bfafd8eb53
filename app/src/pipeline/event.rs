//! What happened, with its time: for a status line and the log.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use coshade_capture::{Timestamp, clock};
use crossbeam_channel::{Receiver, Sender, bounded};

/// Events that may wait to be taken; those beyond are counted.
const CAPACITY: usize = 256;
/// Between two events of a kind that every frame may bring.
const INTERVAL: Duration = Duration::from_secs(1);

/// How bad an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// All is well again.
    Info,
    /// Something was left out or is late; it goes on.
    Warning,
    /// Nothing comes until something is done, or is tried again.
    Error,
}

impl Severity {
    /// In lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// When, on the process's clock.
    pub at: Timestamp,
    /// On which thread.
    pub thread: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// What happened, with names.
    pub message: String,
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s {}: {}", self.at.as_secs_f64(), self.thread, self.message)
    }
}

/// An empty channel of events.
pub fn channel() -> (Outbox, Inbox) {
    let (sender, receiver) = bounded(CAPACITY);
    let dropped = Arc::new(AtomicU64::new(0));
    (Outbox { sender, dropped: Arc::clone(&dropped) }, Inbox { receiver, dropped })
}

/// Where events are taken.
pub struct Inbox {
    receiver: Receiver<Event>,
    dropped: Arc<AtomicU64>,
}

impl Inbox {
    /// Those there are.
    pub fn take(&self) -> impl Iterator<Item = Event> + '_ {
        self.receiver.try_iter()
    }

    /// How many found no room.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

/// Where events are put.
#[derive(Clone)]
pub struct Outbox {
    sender: Sender<Event>,
    dropped: Arc<AtomicU64>,
}

impl Outbox {
    /// For the events of one thread.
    pub fn reporter(&self, thread: &'static str) -> Reporter {
        Reporter { outbox: self.clone(), thread, repeated: HashMap::new() }
    }
}

/// Reports the events of one thread.
pub struct Reporter {
    outbox: Outbox,
    thread: &'static str,
    /// When each kind was reported last, and how often it was not since.
    repeated: HashMap<&'static str, (Timestamp, u64)>,
}

impl Reporter {
    /// Reports. Never blocks.
    pub fn report(&self, severity: Severity, message: impl Into<String>) {
        let event = Event { at: clock::now(), thread: self.thread, severity, message: message.into() };
        if self.outbox.sender.try_send(event).is_err() {
            self.outbox.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Reports what every frame may bring: at most once a second for each `kind`, with how often it was left out.
    pub fn report_often(&mut self, severity: Severity, kind: &'static str, message: impl fmt::Display) {
        let now = clock::now();
        let left_out = match self.repeated.get_mut(kind) {
            Some((last, left_out)) if now.saturating_since(*last) < INTERVAL => {
                *left_out += 1;
                return;
            }
            Some((_, left_out)) => *left_out,
            None => 0,
        };
        self.repeated.insert(kind, (now, 0));
        match left_out {
            0 => self.report(severity, message.to_string()),
            more => self.report(severity, format!("{message} (and {more} more before)")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_every_frame_brings_is_reported_once_and_the_rest_is_counted() {
        let (outbox, inbox) = channel();
        let mut reporter = outbox.reporter("camera");
        for _ in 0..1000 {
            reporter.report_often(Severity::Warning, "damaged", "a frame is damaged");
        }
        reporter.report_often(Severity::Warning, "other", "something else");
        std::thread::sleep(INTERVAL);
        reporter.report_often(Severity::Warning, "damaged", "a frame is damaged");
        let messages: Vec<_> = inbox.take().map(|event| event.message).collect();
        let again = "a frame is damaged (and 999 more before)";
        assert_eq!(messages, ["a frame is damaged", "something else", again]);
    }

    #[test]
    fn nobody_listening_blocks_nobody() {
        let (outbox, inbox) = channel();
        let reporter = outbox.reporter("tracker");
        for number in 0..CAPACITY + 10 {
            reporter.report(Severity::Info, number.to_string());
        }
        assert_eq!((inbox.take().count(), inbox.dropped()), (CAPACITY, 10));
        drop(inbox);
        reporter.report(Severity::Info, "still here");
    }
}
