//! Files that lie: mutated recordings and bags never panic, hang, or take more memory than they are worth.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may panic")]

mod support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use coshade_capture::clock;
use coshade_capture::recording::{Compression, RecordingError, describe};
use support::{Random, record_all, small_chunks};

/// Remembers the largest single piece of memory that was asked for.
struct LargestAllocation;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: hands every call on to the system's allocator unchanged.
unsafe impl GlobalAlloc for LargestAllocation {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are those that the system asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: LargestAllocation = LargestAllocation;

/// Largest allocation for a mutated file of less than 2 MiB: its chunks unpack to less than 2 MiB, a vector doubles, and
/// a compressor's window is 8 MiB.
const MAX_ALLOCATION_BYTES: usize = 16 << 20;

/// Changes a file in one of the ways that files are damaged.
fn mutate(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = bytes.to_vec();
    let at = random.below(out.len() as u64) as usize;
    match random.below(7) {
        0 => out[at] = random.next() as u8,
        // A length, count or offset that is far too large, or nearly wraps around.
        1 => {
            let value = [u64::MAX, u64::MAX - 7, 1 << 63, 1 << 40, 0xffff_ffff, 0x7fff_ffff, 0]
                [random.below(7) as usize];
            let width = [2, 4, 8][random.below(3) as usize].min(out.len() - at);
            out[at..at + width].copy_from_slice(&value.to_le_bytes()[..width]);
        }
        2 => out.truncate(at),
        3 => {
            let end = (at + random.below(64) as usize).min(out.len());
            out.drain(at..end);
        }
        4 => {
            let len = 1 + random.below(64) as usize;
            let piece = random.bytes(len);
            out.splice(at..at, piece);
        }
        5 => {
            let from = random.below(out.len() as u64) as usize;
            let len = (random.below(512) as usize).min(out.len() - from.max(at));
            out.copy_within(from..from + len, at);
        }
        _ => {
            for _ in 0..20 {
                let at = random.below(out.len() as u64) as usize;
                out[at] ^= 1 << random.below(8);
            }
        }
    }
    out
}

/// Opens the file in every way; gives whether something was wrong with it.
fn exercise(path: &Path) -> bool {
    LARGEST.store(0, Ordering::Relaxed);
    let start = clock::now();
    let wrong = match describe(path) {
        Ok(description) => {
            serde_json::to_string(&description).unwrap();
            for damage in &description.damage {
                assert!(damage.offset <= description.size_bytes, "{damage:?}");
            }
            !description.damage.is_empty()
                || description.streams.iter().any(|stream| stream.problem.is_some())
        }
        Err(error) => {
            assert!(error.to_string().contains("mutated"), "no file in: {error}");
            true
        }
    };
    assert!(
        clock::now().saturating_since(start) < Duration::from_secs(5),
        "{:?}",
        clock::now().saturating_since(start)
    );
    let largest = LARGEST.load(Ordering::Relaxed);
    assert!(largest < MAX_ALLOCATION_BYTES, "{largest} bytes at once");
    wrong
}

fn exercise_mutations(name: &str, bytes: &[u8], count: u32) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("mutated_{name}"));
    let mut random = Random(u64::from(count));
    let mut wrong = 0;
    for _ in 0..count {
        std::fs::write(&path, mutate(bytes, &mut random)).unwrap();
        wrong += u32::from(exercise(&path));
    }
    // Some mutations hit what nobody reads, such as an unused index.
    assert!(wrong > count / 3, "{wrong} of {count}");
}

fn recording(compression: Compression) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.mcap");
    record_all(&path, small_chunks(compression), 6);
    std::fs::read(path).unwrap()
}

// One test, for the largest allocation is that of the whole process.
#[test]
fn mutated_files_are_refused_or_read_in_part() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        exercise_mutations("recording.mcap", &recording(compression), 150);
    }
    exercise_mutations("small.bag", &small_bag(), 300);
    if let Some(path) = realsense_bag() {
        exercise_mutations("realsense.bag", &std::fs::read(path).unwrap(), 40);
    }
    summary_is_mutated_where_it_matters();
    not_recordings();
}

/// Mutations of the index alone, whose offsets and lengths lead all over the file.
fn summary_is_mutated_where_it_matters() {
    let bytes = recording(Compression::Lz4);
    let summary_start = mcap::read::footer(&bytes).unwrap().summary_start as usize;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mutated_index.mcap");
    let mut random = Random(3);
    for _ in 0..150 {
        let mut out = bytes[..summary_start].to_vec();
        let mut tail = mutate(&bytes[summary_start..], &mut random);
        // Without its checksum the index is believed.
        let crc_at = tail.len().saturating_sub(12);
        if let Some(crc) = tail.get_mut(crc_at..crc_at + 4) {
            crc.fill(0);
        }
        out.extend(tail);
        std::fs::write(&path, out).unwrap();
        exercise(&path);
    }
}

fn not_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mutated");
    for content in [&b""[..], b"\x89MCA", b"#ROSBAG V1.1\n", b"hello, this is text", b"#ROSBAG V2.0"] {
        std::fs::write(&path, content).unwrap();
        let error = describe(&path).unwrap_err();
        assert!(matches!(error, RecordingError::Format { .. }), "{error}");
        assert!(error.to_string().contains("mutated"), "{error}");
    }
    assert!(matches!(describe(folder.path()), Err(RecordingError::Format { .. })));
    assert!(matches!(describe(folder.path().join("none")), Err(RecordingError::Read { .. })));
}

fn realsense_bag() -> Option<PathBuf> {
    coshade_testdata::find("damaged_recordings", "rgbd/realsense-bag/single_depth_color_640x480.bag")
}

/// A bag with one uncompressed chunk of three images.
fn small_bag() -> Vec<u8> {
    support::bag::Bag::new().chunk("none", |chunk| {
        chunk.connection(0, "/camera/image", "sensor_msgs/Image");
        for index in 0..3 {
            chunk.message(
                0,
                1_000 + index,
                &support::bag::image(index as u32, "mono8", 8, 4, 8, &[index as u8; 32]),
            );
        }
    })
}
