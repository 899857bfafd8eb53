//! The overwriting mailbox.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use coshade_capture::clock::now;
use coshade_capture::latest::ReaderGone;
use coshade_capture::{LatestError, latest};

const LONG: Duration = Duration::from_secs(20);

#[test]
fn the_reader_sees_the_newest_and_the_rest_is_counted() {
    let (sender, mut receiver) = latest();
    for n in 0..5 {
        sender.send(n).unwrap();
    }
    assert_eq!(receiver.receive(LONG), Ok(4));
    assert_eq!((sender.overwritten(), receiver.overwritten()), (4, 4));
    assert_eq!(receiver.take(), None);
    assert_eq!(receiver.receive(Duration::from_millis(5)), Err(LatestError::Timeout));
    sender.send(7).unwrap();
    assert_eq!(receiver.take(), Some(7));
    // The token of 7 is still there: it must not be mistaken for a value.
    assert_eq!(receiver.receive(Duration::from_millis(5)), Err(LatestError::Timeout));
}

#[test]
fn a_timeout_is_kept_and_zero_does_not_wait() {
    let (sender, mut receiver) = latest::<u8>();
    let start = now();
    assert_eq!(receiver.receive(Duration::from_millis(30)), Err(LatestError::Timeout));
    assert!(now().saturating_since(start) >= Duration::from_millis(30));
    sender.send(1).unwrap();
    assert_eq!(receiver.receive(Duration::ZERO), Ok(1));
}

#[test]
fn closing_delivers_the_last_value_first_and_wakes_a_waiting_reader() {
    let (sender, mut receiver) = latest();
    sender.send(1).unwrap();
    drop(sender);
    assert_eq!(receiver.receive(LONG), Ok(1));
    assert_eq!(receiver.receive(LONG), Err(LatestError::Closed));

    let (sender, mut receiver) = latest::<u8>();
    std::thread::scope(|scope| {
        let waiting = scope.spawn(move || receiver.receive(LONG));
        std::thread::sleep(Duration::from_millis(20));
        drop(sender);
        assert_eq!(waiting.join().unwrap(), Err(LatestError::Closed));
    });
}

#[test]
fn sending_to_nobody_is_an_error_and_values_are_dropped() {
    let (sender, receiver) = latest();
    drop(receiver);
    assert_eq!(sender.send(1), Err(ReaderGone));

    let value = std::sync::Arc::new(());
    let (sender, receiver) = latest();
    sender.send(value.clone()).unwrap();
    drop((sender, receiver));
    assert_eq!(std::sync::Arc::strong_count(&value), 1);
}

/// The sender waits for each value to be seen: one lost wake-up and the reader sleeps until its time is over.
#[test]
fn no_wake_up_is_lost() {
    let (sender, mut receiver) = latest();
    let (back, mut seen) = latest();
    std::thread::scope(|scope| {
        scope.spawn(move || {
            while let Ok(n) = receiver.receive(LONG) {
                back.send(n).unwrap();
            }
        });
        for n in 0..10_000 {
            sender.send(n).unwrap();
            assert_eq!(seen.receive(LONG), Ok(n));
        }
        drop(sender);
    });
}

/// A sender at full speed: what arrives is in order, the last one always arrives, and every value is either received
/// or counted as overwritten.
#[test]
fn under_load_values_are_received_in_order_or_counted() {
    const SENT: u64 = 200_000;
    let (sender, mut receiver) = latest();
    let slow = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let (mut received, mut last) = (0, None);
            loop {
                match receiver.receive(LONG) {
                    Ok(n) => {
                        assert!(last < Some(n), "{n} after {last:?}");
                        (received, last) = (received + 1, Some(n));
                        if slow.load(Ordering::Relaxed) {
                            std::thread::yield_now();
                        }
                    }
                    Err(LatestError::Closed) => return (received, last, receiver.overwritten()),
                    Err(LatestError::Timeout) => panic!("a wake-up was lost after {last:?}"),
                }
            }
        });
        for n in 0..SENT {
            sender.send(n).unwrap();
            slow.store(n % 1000 < 500, Ordering::Relaxed);
        }
        drop(sender);
        let (received, last, overwritten) = reader.join().unwrap();
        assert_eq!(last, Some(SENT - 1));
        assert_eq!(received + overwritten, SENT);
    });
}
