//! Broken and hostile files: always an image or an error that names the file, in bounded time and memory.
#![allow(clippy::unwrap_used, reason = "helpers of tests panic as tests do")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use coshade_image_file::{BitDepth, Channel, Image, ReadLimits, outline, read_bytes, write_png};
use coshade_testdata::mutate::mutations;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call goes to `System` unchanged; the counters do not touch memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let live = LIVE.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(live, Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const LIMITS: ReadLimits = ReadLimits { max_decoded_bytes: 4 << 20, max_side_px: 4096 };
/// File, decoder's samples and ours, and the decoders' tables.
const PEAK_BYTES: usize = 3 * (4 << 20) + (4 << 20);
const MUTATIONS_PER_FORMAT: u64 = 3000;

fn seeds(format: &str) -> Vec<Vec<u8>> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let all = |names: &[&str]| names.iter().map(|name| std::fs::read(data.join(name)).unwrap()).collect();
    match format {
        "exr" => {
            let names = std::fs::read_dir(data.join("exr")).unwrap().map(|entry| entry.unwrap().path());
            let mut names: Vec<PathBuf> =
                names.filter(|path| path.extension().is_some_and(|e| e == "exr")).collect();
            names.sort();
            names.iter().map(|path| std::fs::read(path).unwrap()).collect()
        }
        "png" => vec![png(&["R", "G", "B"], BitDepth::Eight), png(&["Y", "A"], BitDepth::Sixteen)],
        "jpg" => all(&["small.jpg", "small_progressive.jpg"]),
        _ => vec![radiance(true), radiance(false)],
    }
}

/// A PNG of 32×24 px with the given channels.
fn png(names: &[&str], depth: BitDepth) -> Vec<u8> {
    let plane = |channel: usize| (0..32 * 24).map(|i| ((i * (7 + channel) / 3) % 64) as f32 / 63.0).collect();
    let channels = names.iter().enumerate();
    let channels = channels.map(|(index, name)| Channel { name: (*name).into(), samples: plane(index) });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seed.png");
    write_png(&path, &Image::new(32, 24, channels.collect()).unwrap(), depth).unwrap();
    std::fs::read(path).unwrap()
}

/// A Radiance picture of 40×12 px, with component runs or plain.
fn radiance(runs: bool) -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1.5\n\n-Y 12 +X 40\n".to_vec();
    for row in 0..12u8 {
        if runs {
            bytes.extend([2, 2, 0, 40]);
            for component in 0..4 {
                bytes.extend([128 + 30, 90 + row, 10]);
                bytes.extend((0..10).map(|i| 120 + i + component));
            }
        } else {
            (0..40u8).for_each(|x| bytes.extend([x, row, 200 - x, 128]));
        }
    }
    bytes
}

/// Makes the checksums of a PNG's chunks right again, so that mutations get past them.
fn repair_checksums(png: &mut [u8]) {
    let mut at = 8;
    while let Some(length) =
        png.get(at..at + 4).and_then(|bytes| bytes.try_into().ok()).map(u32::from_be_bytes)
    {
        let end = at + 8 + length as usize;
        let Some(body) = png.get(at + 4..end) else { return };
        let checksum = crc32(body).to_be_bytes();
        png.iter_mut().skip(end).zip(checksum).for_each(|(byte, new)| *byte = new);
        at = end + 4;
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    let bit = |crc: u32| (crc >> 1) ^ (0xedb8_8320 & 0u32.wrapping_sub(crc & 1));
    !bytes.iter().fold(u32::MAX, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |crc, _| bit(crc)))
}

// One test, so that nothing else allocates meanwhile.
#[test]
fn mutated_files_are_read_or_refused() {
    // Resolving a backtrace takes more memory than the files: the exr crate's caught panics are told in a line.
    std::panic::set_hook(Box::new(|panic| println!("{panic}")));
    for format in ["exr", "hdr", "png", "jpg"] {
        let path = PathBuf::from(format!("mutated.{format}"));
        let seeds = seeds(format);
        let each = MUTATIONS_PER_FORMAT / seeds.len() as u64;
        let (mut refused, mut tried, mut slowest, mut highest) = (0, 0, Duration::ZERO, 0);
        let corpus = seeds.iter().enumerate().flat_map(|(seed, bytes)| {
            mutations(bytes, each)
                .map(move |(mutation, bytes)| (format!("{format} {seed} {mutation}"), mutation, bytes))
        });
        for (name, mutation, mut bytes) in corpus {
            tried += 1;
            if format == "png" && mutation % 4 != 0 {
                repair_checksums(&mut bytes);
            }
            let before = LIVE.load(Ordering::Relaxed);
            PEAK.store(before, Ordering::Relaxed);
            #[allow(clippy::disallowed_methods, reason = "measures real time; there is nothing to replay")]
            let start = Instant::now();
            let outlined = outline(&path, &bytes, &LIMITS);
            let result = read_bytes(&path, &bytes, &LIMITS);
            slowest = slowest.max(start.elapsed());
            let peak = PEAK.load(Ordering::Relaxed) - before;
            highest = highest.max(peak);
            assert!(peak <= PEAK_BYTES, "{name}: {peak} bytes");
            let is_linear = ["exr", "hdr"].contains(&format);
            assert!(outlined.is_ok() || result.is_err() || !is_linear, "{name}: {outlined:?}");
            if let Err(error) = result {
                refused += 1;
                let message = error.to_string();
                assert!(message.starts_with("mutated.") && message.len() < 2000, "{message}");
            }
        }
        println!("{format}: {refused} of {tried} refused, slowest {slowest:?}, most {highest} bytes");
        assert!(slowest < Duration::from_secs(2), "{format}: {slowest:?}");
        // Mutations that break nothing, or everything, would test nothing.
        assert!(refused > tried / 10 && refused < tried, "{format}: {refused}");
    }
}
