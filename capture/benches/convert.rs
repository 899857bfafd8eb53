//! Speed of pixel conversion at 1280 x 720, in pixels a second; `copy` is what memory allows.
#![allow(clippy::unwrap_used, reason = "a benchmark that cannot set up has nothing to measure")]

use std::hint::black_box;

use coshade_capture::{ChromaUpsampling, Converter, Frame, PixelFormat};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const WIDTH: u32 = 1280;
const HEIGHT: u32 = 720;

/// A picture with structure: random bytes would flatter branch-free code and be no JPEG.
fn raw_frame(format: PixelFormat) -> Frame {
    let bytes = (WIDTH * HEIGHT * 3) as usize;
    let pixels: Vec<u8> = (0..bytes).map(|n| (n / 7 + n / 1280 * 3) as u8).collect();
    Frame::packed(format, WIDTH, HEIGHT, pixels).unwrap()
}

fn linear_frame() -> Frame {
    let values = (0..WIDTH * HEIGHT * 3).map(|n| ((n / 7 + n / 1280 * 3) % 1200) as f32 / 1000.0);
    let pixels: Vec<u8> = values.flat_map(f32::to_le_bytes).collect();
    Frame::packed(PixelFormat::RgbF32, WIDTH, HEIGHT, pixels).unwrap()
}

fn jpeg_frame() -> Frame {
    let picture = image::RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        image::Rgb([(x / 5) as u8, (y / 3) as u8, ((x * y) >> 9) as u8])
    });
    let mut jpeg = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut jpeg, image::ImageFormat::Jpeg).unwrap();
    Frame::packed(PixelFormat::Mjpg, WIDTH, HEIGHT, jpeg.into_inner()).unwrap()
}

fn convert(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("convert");
    group.throughput(Throughput::Elements(u64::from(WIDTH * HEIGHT))).sample_size(30);
    let mut rgb = vec![0_u8; (WIDTH * HEIGHT * 3) as usize];
    let mut grey = vec![0_u8; (WIDTH * HEIGHT) as usize];
    let mut numbers = vec![0_f32; (WIDTH * HEIGHT * 3) as usize];

    let copied = raw_frame(PixelFormat::Rgb24);
    group.bench_function("copy RGB24", |b| b.iter(|| black_box(&mut rgb).copy_from_slice(&copied.pixels)));
    for format in [PixelFormat::Yuyv, PixelFormat::Nv12] {
        let frame = raw_frame(format);
        for chroma in [ChromaUpsampling::Nearest, ChromaUpsampling::Linear] {
            let mut converter = Converter::with_chroma(chroma);
            let name = format!("{format} to RGB24, {chroma:?}");
            group.bench_function(name, |b| {
                b.iter(|| converter.rgb24(black_box(&frame), black_box(&mut rgb)).unwrap());
            });
        }
    }
    let mut converter = Converter::new();
    for frame in [raw_frame(PixelFormat::Yuyv), raw_frame(PixelFormat::Rgb24), linear_frame(), jpeg_frame()] {
        let format = frame.format;
        group.bench_function(format!("{format} to GREY"), |b| {
            b.iter(|| converter.grey(black_box(&frame), black_box(&mut grey)).unwrap());
        });
        group.bench_function(format!("{format} to f32"), |b| {
            b.iter(|| converter.rgb_f32(black_box(&frame), black_box(&mut numbers)).unwrap());
        });
    }
    for frame in [linear_frame(), jpeg_frame()] {
        group.bench_function(format!("{} to RGB24", frame.format), |b| {
            b.iter(|| converter.rgb24(black_box(&frame), black_box(&mut rgb)).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, convert);
criterion_main!(benches);
