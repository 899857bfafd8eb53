//! Frames to record, and their comparison.
#![allow(dead_code, reason = "each test binary uses a part")]

pub mod bag;

use std::path::Path;
use std::time::Duration;

use coshade_capture::recording::{
    Compression, Reader, RecordedFrame, RecordingOptions, RecordingWriter, StreamId,
};
use coshade_capture::{ColorEncoding, Frame, PixelFormat, Timestamp, YuvMatrix, YuvRange};

pub const FORMATS: [PixelFormat; 9] = [
    PixelFormat::Yuyv,
    PixelFormat::Uyvy,
    PixelFormat::Nv12,
    PixelFormat::Grey,
    PixelFormat::Y16,
    PixelFormat::Z16,
    PixelFormat::Rgb24,
    PixelFormat::RgbF32,
    PixelFormat::Mjpg,
];

/// SplitMix64: numbers that look random and are the same in every run.
#[derive(Clone)]
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    pub fn bytes(&mut self, len: usize) -> Vec<u8> {
        (0..len).map(|_| self.next() as u8).collect()
    }
}

/// Frame `index` of a stream: every field is something, rows are padded by a number that changes.
pub fn frame(format: PixelFormat, index: u64) -> Frame {
    let mut random = Random(index * 31 + format as u64);
    let (width, height) = (2 * (5 + random.below(6)) as u32, 2 * (3 + random.below(3)) as u32);
    let padding = random.below(4) as u32 * 3;
    let stride = if format == PixelFormat::Mjpg { 0 } else { width * format.bytes_per_row_pixel() + padding };
    let rows = if format == PixelFormat::Nv12 { height * 3 / 2 } else { height };
    let len = if stride == 0 { 200 + random.below(200) } else { u64::from(stride * rows) };
    let mut pixels = random.bytes(len as usize);
    if format == PixelFormat::RgbF32 {
        // Any finite numbers: the exponent's lowest bit is 0, so it is not the one of infinities.
        let rows = pixels.chunks_exact_mut(stride as usize).flat_map(|row| row.as_chunks_mut::<4>().0);
        rows.for_each(|number| number[2] &= 0x7f);
    }
    let mut frame = Frame::new(format, width, height, stride, pixels).unwrap();
    frame.captured = Timestamp::from_ns(1_000_000_000 + index * 10_000_000 + random.below(1_000_000));
    frame.arrived = frame.captured + Duration::from_nanos(random.below(5_000_000));
    // Numbers beyond 32 bits, with a gap every ten frames.
    frame.sequence = (1 << 40) + index + index / 10;
    frame.exposure = (!index.is_multiple_of(3)).then(|| Duration::from_nanos(random.below(50_000_000)));
    frame.gain = (!index.is_multiple_of(4)).then(|| random.below(1000) as f32 / 7.0);
    frame.depth_unit_m = (format == PixelFormat::Z16).then_some(0.000_25 + index as f64 * 1e-9);
    let matrix = if index.is_multiple_of(2) { YuvMatrix::Bt709 } else { YuvMatrix::Bt601 };
    let range = if index.is_multiple_of(5) { YuvRange::Full } else { YuvRange::Limited };
    frame.color = ColorEncoding { matrix, range };
    frame
}

pub fn assert_same(a: &Frame, b: &Frame) {
    assert_eq!(a.pixels, b.pixels);
    let properties = |f: &Frame| {
        let size = (f.format, f.width_px, f.height_px, f.stride_bytes, f.color);
        let bits = (f.gain.map(f32::to_bits), f.depth_unit_m.map(f64::to_bits));
        (size, f.captured, f.arrived, f.sequence, f.exposure, bits)
    };
    assert_eq!(properties(a), properties(b));
}

/// Options for small chunks, so that a small file has many.
pub fn small_chunks(compression: Compression) -> RecordingOptions {
    RecordingOptions {
        compression,
        chunk_bytes: 4000,
        chunk_time: Duration::from_secs(100),
        ..RecordingOptions::default()
    }
}

/// Records `count` frames of each format, one stream a format, in turns.
pub fn record_all(path: &Path, options: RecordingOptions, count: u64) {
    let mut writer = RecordingWriter::create(path, options).unwrap();
    let streams: Vec<StreamId> =
        FORMATS.iter().map(|format| writer.add_stream(&format.to_string(), None, None).unwrap()).collect();
    for index in 0..count {
        for (stream, format) in streams.iter().zip(FORMATS) {
            writer.write(*stream, &frame(format, index), 0).unwrap();
        }
    }
    writer.finish(&[]).unwrap();
}

/// All frames that can be read, and the errors in between.
pub fn read_all(path: &Path) -> (Vec<RecordedFrame>, Vec<String>) {
    let mut reader = Reader::open(path).unwrap();
    let (mut frames, mut errors) = (Vec::new(), Vec::new());
    loop {
        match reader.next_frame() {
            Ok(Some(frame)) => frames.push(frame),
            Ok(None) => return (frames, errors),
            Err(error) => errors.push(error.to_string()),
        }
        assert!(errors.len() < 100_000, "the reader does not come to an end");
    }
}
