//! Records synthetic frames of every pixel format and prints, as JSON, what another reader must find in the file.
//!
//! `make_recording FILE.mcap` writes 12 frames of each format. `make_recording FILE.mcap --bench` instead measures what
//! recording 640 × 480 YUYV frames costs, for each compression.

use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

use coshade_capture::clock;
use coshade_capture::recording::{Compression, RecordedTransform, RecordingOptions, RecordingWriter};
use coshade_capture::{Frame, PixelFormat, Timestamp};
use coshade_lens::calibration::Calibration;
use serde_json::{Value, json};

const FORMATS: [PixelFormat; 9] = [
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

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let line = match arguments.as_slice() {
        [path] => json!(record(Path::new(path))?),
        [path, option] if option == "--bench" => json!(bench(Path::new(path))?),
        _ => return Err("usage: make_recording FILE.mcap [--bench]".into()),
    };
    writeln!(std::io::stdout(), "{line:#}")?;
    Ok(())
}

/// A slope with noise: bytes that are neither all the same nor all random.
fn pixels(len: usize, seed: usize, noise_bits: u32) -> Vec<u8> {
    let mut state = seed as u32 * 2 + 1;
    let noise = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> (32 - noise_bits)) as u8
    };
    let slope = (0..len).map(|index| (index / 97 + seed) as u8);
    slope.zip(std::iter::repeat_with(noise)).map(|(slope, noise)| slope.wrapping_add(noise)).collect()
}

fn frame(format: PixelFormat, index: u64) -> Result<Frame, Box<dyn Error>> {
    let (width, height) = (64, 48);
    let stride = if format == PixelFormat::Mjpg { 0 } else { width * format.bytes_per_row_pixel() + 6 };
    let rows = if format == PixelFormat::Nv12 { height * 3 / 2 } else { height };
    let len = if stride == 0 { 1000 } else { (stride * rows) as usize };
    let mut pixels = pixels(len, index as usize, 3);
    if format == PixelFormat::RgbF32 {
        // Finite numbers: the exponent's lowest bit is 0, so it is not the one of infinities.
        let rows = pixels.chunks_exact_mut(stride as usize).flat_map(|row| row.as_chunks_mut::<4>().0);
        rows.for_each(|number| number[2] &= 0x7f);
    }
    let mut frame = Frame::new(format, width, height, stride, pixels)?;
    frame.captured = Timestamp::from_ns(5_000_000_000 + index * 33_333_333 + format as u64);
    frame.arrived = frame.captured + Duration::from_millis(2);
    frame.sequence = 1000 + index;
    frame.exposure = Some(Duration::from_micros(8000 + index));
    frame.gain = Some(1.5);
    frame.depth_unit_m = (format == PixelFormat::Z16).then_some(0.001);
    Ok(frame)
}

fn record(path: &Path) -> Result<Value, Box<dyn Error>> {
    let session = "version = 1\n".to_owned();
    let options =
        RecordingOptions { overwrite: true, session: Some(session.clone()), ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(path, options)?;
    let calibration = Calibration::default_for([64, 48], 1.1)?;
    let mut streams = Vec::new();
    for format in FORMATS {
        streams.push((format, writer.add_stream(&format.to_string(), Some(&calibration), Some(30.0))?));
    }
    let mut expected = Vec::new();
    for index in 0..12 {
        for &(format, stream) in &streams {
            let frame = frame(format, index)?;
            expected.push(json!({
                "stream": format.to_string(),
                "log_time": frame.captured.as_ns(),
                "arrived_ns": frame.arrived.as_ns(),
                "sequence": frame.sequence,
                "exposure_ns": frame.exposure.map(|time| time.as_nanos() as u64),
                "stride": frame.stride_bytes,
                "bytes": frame.pixels.len(),
                "crc32": crc32fast::hash(&frame.pixels),
            }));
            writer.write(stream, &frame, 0)?;
        }
        let stamp = Timestamp::from_ns(5_000_000_000 + index * 33_333_333);
        let (parent, child) = ("world".to_owned(), "YUYV".to_owned());
        let (translation_m, rotation_xyzw) = ([0.1, 0.2, index as f64], [0.0, 0.0, 0.0, 1.0]);
        writer.write_transform(&RecordedTransform { stamp, parent, child, translation_m, rotation_xyzw })?;
    }
    writer.finish(&[0; FORMATS.len()])?;
    let lens = calibration.model.intrinsics();
    let k = [lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0];
    Ok(json!({ "frames": expected, "transforms": 12, "session": session, "k": k }))
}

/// Seconds of CPU that this process has used, all threads together.
fn cpu_s() -> Result<f64, Box<dyn Error>> {
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    let ticks: f64 =
        fields.get(11..13).unwrap_or(&[]).iter().filter_map(|field| field.parse::<f64>().ok()).sum();
    Ok(ticks / 100.0)
}

fn bench(path: &Path) -> Result<Vec<Value>, Box<dyn Error>> {
    const FRAMES: u64 = 600;
    let (yuyv_bytes, depth_bytes) = (640 * 480 * 2, 640 * 480 * 2);
    let mut results = Vec::new();
    for (what, format, len, noise_bits) in
        [("noisy YUYV", PixelFormat::Yuyv, yuyv_bytes, 3), ("smooth depth", PixelFormat::Z16, depth_bytes, 0)]
    {
        let mut source = Frame::packed(format, 640, 480, pixels(len, 1, noise_bits.max(1)))?;
        if noise_bits == 0 {
            // Steps of a millimetre over some pixels, a tenth without measurement: as depth cameras deliver.
            let code = |index: usize| if index % 640 < 64 { 0_u16 } else { 800 + (index / 7 % 300) as u16 };
            let codes = (0..640 * 480).flat_map(|index| code(index).to_le_bytes());
            source = Frame::packed(format, 640, 480, codes.collect::<Vec<u8>>())?;
            source.depth_unit_m = Some(0.001);
        }
        for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
            let options = RecordingOptions { overwrite: true, compression, ..RecordingOptions::default() };
            let mut writer = RecordingWriter::create(path, options)?;
            let stream = writer.add_stream("camera", None, None)?;
            let (start, start_cpu_s) = (clock::now(), cpu_s()?);
            for index in 0..FRAMES {
                source.captured = Timestamp::from_ns(index * 33_333_333);
                source.sequence = index;
                writer.write(stream, &source, 0)?;
            }
            writer.finish(&[0])?;
            let wall_s = clock::now().saturating_since(start).as_secs_f64();
            let megabytes = (FRAMES as usize * len) as f64 * 1e-6;
            results.push(json!({
                "pixels": what,
                "compression": format!("{compression:?}"),
                "megabytes_per_s": (megabytes / wall_s).round(),
                "cpu_ms_per_frame": (cpu_s()? - start_cpu_s) * 1e3 / FRAMES as f64,
                "file_size_ratio": std::fs::metadata(path)?.len() as f64 * 1e-6 / megabytes,
            }));
        }
    }
    Ok(results)
}
