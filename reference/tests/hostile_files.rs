//! Broken and hostile files: always an image or an error that names the file, in bounded time and memory.

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use coshade_reference::image_file::{ReadLimits, read_bytes};

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

const LIMITS: ReadLimits = ReadLimits {
    max_decoded_bytes: 4 << 20,
    max_side_px: 4096,
};
/// File, decoder's samples and ours, and the decoders' tables.
const PEAK_BYTES: usize = 3 * (4 << 20) + (4 << 20);
const MUTATIONS_PER_FORMAT: usize = 3000;

fn seeds(format: &str) -> Vec<Vec<u8>> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let all = |names: &[&str]| {
        names
            .iter()
            .map(|name| std::fs::read(data.join(name)).unwrap())
            .collect()
    };
    match format {
        "exr" => {
            let names = std::fs::read_dir(data.join("exr"))
                .unwrap()
                .map(|entry| entry.unwrap().path());
            let mut names: Vec<PathBuf> = names
                .filter(|path| path.extension().is_some_and(|e| e == "exr"))
                .collect();
            names.sort();
            names.iter().map(|path| std::fs::read(path).unwrap()).collect()
        }
        "png" => all(&["pairs/noise_a.png", "pairs/blur_a.png"]),
        "jpg" => all(&["small.jpg", "small_progressive.jpg"]),
        _ => vec![radiance(true), radiance(false)],
    }
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

struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound.max(1)
    }

    /// Flips bytes (mostly in the header), plants extreme numbers, cuts, doubles and removes stretches.
    fn mutate(&mut self, seed: &[u8]) -> Vec<u8> {
        const EXTREMES: [u32; 8] = [
            0,
            1,
            u32::MAX,
            0x7fff_ffff,
            0x8000_0000,
            0xffff,
            0x0100_0000,
            0x3fff_ffff,
        ];
        let mut bytes = seed.to_vec();
        for _ in 0..1 + self.below(4) {
            let reach = if self.below(3) == 0 {
                bytes.len()
            } else {
                bytes.len().min(450)
            };
            let at = self.below(reach);
            match self.below(6) {
                0 => bytes.truncate(at),
                1 | 2 => bytes
                    .iter_mut()
                    .skip(at)
                    .take(1)
                    .for_each(|byte| *byte = self.below(256) as u8),
                3 => {
                    let value = EXTREMES[self.below(EXTREMES.len())];
                    let value = if self.below(2) == 0 {
                        value.to_le_bytes()
                    } else {
                        value.to_be_bytes()
                    };
                    bytes
                        .iter_mut()
                        .skip(at)
                        .zip(value)
                        .for_each(|(byte, new)| *byte = new);
                }
                4 => {
                    let end = (at + self.below(60)).min(bytes.len());
                    let copy = bytes[at..end].to_vec();
                    bytes.splice(at..at, copy);
                }
                _ => {
                    let end = (at + self.below(60)).min(bytes.len());
                    bytes.drain(at..end);
                }
            }
        }
        bytes
    }
}

/// Makes the checksums of a PNG's chunks right again, so that mutations get past them.
fn repair_checksums(png: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = png
        .get(at..at + 4)
        .and_then(|bytes| bytes.try_into().ok())
        .map(u32::from_be_bytes)
    {
        let end = at + 8 + length as usize;
        let Some(body) = png.get(at + 4..end) else { return };
        let checksum = crc32(body).to_be_bytes();
        png.iter_mut()
            .skip(end)
            .zip(checksum)
            .for_each(|(byte, new)| *byte = new);
        at = end + 4;
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    let bit = |crc: u32| (crc >> 1) ^ (0xedb8_8320 & 0u32.wrapping_sub(crc & 1));
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| bit(crc))
    })
}

// One test, so that nothing else allocates meanwhile.
#[test]
fn mutated_files_are_read_or_refused() {
    // Resolving a backtrace takes more memory than the files: the exr crate's caught panics are told in a line.
    std::panic::set_hook(Box::new(|panic| println!("{panic}")));
    for (format, seed) in [("exr", 1), ("hdr", 2), ("png", 3), ("jpg", 4)] {
        let path = PathBuf::from(format!("mutated.{format}"));
        let seeds = seeds(format);
        let mut random = Random(seed);
        let (mut refused, mut slowest, mut highest) = (0, Duration::ZERO, 0);
        for index in 0..MUTATIONS_PER_FORMAT {
            let mut bytes = random.mutate(&seeds[index % seeds.len()]);
            if format == "png" && index % 4 != 0 {
                repair_checksums(&mut bytes);
            }
            let before = LIVE.load(Ordering::Relaxed);
            PEAK.store(before, Ordering::Relaxed);
            #[allow(
                clippy::disallowed_methods,
                reason = "measures real time; there is nothing to replay"
            )]
            let start = Instant::now();
            let result = read_bytes(&path, &bytes, &LIMITS);
            slowest = slowest.max(start.elapsed());
            let peak = PEAK.load(Ordering::Relaxed) - before;
            highest = highest.max(peak);
            assert!(peak <= PEAK_BYTES, "{format} {index}: {peak} bytes");
            if let Err(error) = result {
                refused += 1;
                let message = error.to_string();
                assert!(
                    message.starts_with("mutated.") && message.len() < 2000,
                    "{message}"
                );
            }
        }
        println!(
            "{format}: {refused} of {MUTATIONS_PER_FORMAT} refused, slowest {slowest:?}, most {highest} bytes"
        );
        assert!(slowest < Duration::from_secs(2), "{format}: {slowest:?}");
        // Mutations that break nothing, or everything, would test nothing.
        assert!(
            refused > MUTATIONS_PER_FORMAT / 10 && refused < MUTATIONS_PER_FORMAT,
            "{format}: {refused}"
        );
    }
}
