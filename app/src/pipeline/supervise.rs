//! Named threads whose panics are caught, and that end in time.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::{Context as _, anyhow, bail};
use coshade_capture::{Timestamp, clock};

/// A thread that is to be waited for.
pub struct Watched {
    name: &'static str,
    handle: JoinHandle<anyhow::Result<()>>,
}

/// Starts a thread.
///
/// # Errors
/// The system has none left.
pub fn spawn(
    name: &'static str,
    body: impl FnOnce() -> anyhow::Result<()> + Send + 'static,
) -> anyhow::Result<Watched> {
    let handle = thread::Builder::new().name(name.to_owned()).spawn(body);
    Ok(Watched { name, handle: handle.with_context(|| format!("no thread for `{name}`"))? })
}

impl Watched {
    /// Waits for its end until `deadline`.
    ///
    /// # Errors
    /// Its error or panic, with its name; that it hangs, in which case it is left behind.
    pub fn join_by(self, deadline: Timestamp) -> anyhow::Result<()> {
        let name = self.name;
        while !self.handle.is_finished() {
            if clock::now() >= deadline {
                bail!("thread `{name}` does not end: it is left behind");
            }
            thread::sleep(Duration::from_millis(2));
        }
        match self.handle.join() {
            Ok(ended) => ended.with_context(|| format!("thread `{name}`")),
            Err(panic) => Err(anyhow!("thread `{name}` has panicked: {}", message(panic.as_ref()))),
        }
    }
}

/// Runs `work`.
///
/// # Errors
/// The message of its panic. What `work` had borrowed may be half done and must be thrown away.
pub fn guarded<V>(work: impl FnOnce() -> V) -> Result<V, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| message(panic.as_ref()))
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("without a message").to_owned()
}

/// CPU time that the calling thread has used, where the system tells (Linux).
pub fn thread_cpu() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn soon() -> Timestamp {
        clock::now() + Duration::from_millis(500)
    }

    #[test]
    fn how_a_thread_ended_is_said_with_its_name() {
        assert!(spawn("fine", || Ok(())).unwrap().join_by(soon()).is_ok());
        let failed = spawn("reader", || bail!("no such file")).unwrap().join_by(soon()).unwrap_err();
        assert_eq!(format!("{failed:#}"), "thread `reader`: no such file");
        let panicked = spawn("solver", || panic!("index {} out of 3", 7)).unwrap().join_by(soon());
        assert_eq!(panicked.unwrap_err().to_string(), "thread `solver` has panicked: index 7 out of 3");
    }

    #[test]
    fn a_thread_that_hangs_is_left_behind() {
        let (_release, held) = crossbeam_channel::bounded::<()>(0);
        let hanging = spawn("driver", move || {
            let _ = held.recv();
            Ok(())
        });
        let begun = clock::now();
        let error = hanging.unwrap().join_by(clock::now() + Duration::from_millis(50)).unwrap_err();
        assert!(error.to_string().contains("`driver` does not end"), "{error}");
        assert!(clock::now().saturating_since(begun) < Duration::from_secs(5), "waited for it");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn work_costs_cpu_time_and_sleep_does_not() {
        let spent = |work: &dyn Fn()| {
            let before = thread_cpu().unwrap();
            work();
            thread_cpu().unwrap() - before
        };
        let slept = spent(&|| thread::sleep(Duration::from_millis(60)));
        assert!(slept < Duration::from_millis(30), "{slept:?}");
        // Runs until the clock of the thread has moved, however slow the machine is.
        let before = thread_cpu().unwrap();
        while thread_cpu().unwrap() - before < Duration::from_millis(5) {}
    }
}
