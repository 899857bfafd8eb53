//! Damaged image files: an error or an image, but never a panic, a hang or a huge allocation.
#![allow(clippy::unwrap_used, reason = "helpers of tests panic as tests do")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use coshade_capture::clock::now;
use coshade_capture::images::describe;
use coshade_capture::{CaptureError, Converter, Frame, PixelFormat, open};
use coshade_testdata::mutate::mutations;
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb};

struct Largest;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Largest {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Largest = Largest;

/// The seeds are below 8 KiB: what a compressed image of that size can hold at most, and the decoders' own windows.
const MAX_ALLOCATION_BYTES: usize = 64 << 20;

fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let color =
        DynamicImage::ImageRgb8(ImageBuffer::from_fn(24, 18, |x, y| Rgb([9 * x as u8, 12 * y as u8, 77])));
    let depth = DynamicImage::ImageLuma16(ImageBuffer::from_fn(24, 18, |x, y| Luma([(900 * x + y) as u16])));
    let encode = |image: &DynamicImage, format| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    };
    let text: String = (0..24 * 18).map(|n| format!("{} ", n % 200)).collect();
    vec![
        ("png", encode(&color, ImageFormat::Png)),
        ("png", encode(&depth, ImageFormat::Png)),
        ("jpg", encode(&color, ImageFormat::Jpeg)),
        ("pgm", [b"P5 24 18 65535\n", depth.as_bytes()].concat()),
        ("ppm", [b"P6 24 18 255\n", color.as_bytes()].concat()),
        ("exr", include_bytes!("../../image-file/tests/data/exr/zip.exr").to_vec()),
        ("exr", include_bytes!("../../image-file/tests/data/exr/none.exr").to_vec()),
        (
            "hdr",
            [&b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 18 +X 6\n"[..], &[90, 60, 30, 128].repeat(6 * 18)]
                .concat(),
        ),
        ("pgm", format!("P2\n# text\n24 18\n255\n{text}").into_bytes()),
    ]
}

#[test]
fn damaged_files_are_refused_or_read_in_bounded_time_and_memory() {
    let folder = tempfile::tempdir().unwrap();
    let start = now();
    for (kind, (extension, seed)) in seeds().into_iter().enumerate() {
        let path = folder.path().join(format!("{kind}.{extension}"));
        let (mut frames, mut refused) = (0, 0);
        for (n, damaged) in mutations(&seed, 250) {
            fs::write(&path, damaged).unwrap();
            for options in ["", "&as=grey", "&depth_unit_m=0.001"] {
                let found = open(&format!("images:{}?pace=fast{options}", path.display()))
                    .and_then(|mut camera| camera.next_frame(Duration::ZERO));
                match found {
                    Ok(frame) => {
                        frame.check().unwrap();
                        frames += 1;
                    }
                    Err(CaptureError::Lost { reason, .. } | CaptureError::Damaged { reason, .. }) => {
                        assert!(!reason.is_empty());
                        refused += 1;
                    }
                    Err(other) => panic!("{extension} {n}: {other}"),
                }
            }
        }
        // Both must happen for the test to mean something; a PNG's checksums let hardly any damage pass.
        assert!(frames >= 3 && refused > 200, "{kind} {extension}: {frames} frames, {refused} refused");
    }
    assert!(describe(folder.path(), None).is_ok());
    let largest = LARGEST.load(Ordering::Relaxed);
    assert!(largest < MAX_ALLOCATION_BYTES, "{largest} bytes at once");
    assert!(now().saturating_since(start) < Duration::from_secs(30));
}

#[test]
fn damaged_lists_are_refused_or_read() {
    let folder = tempfile::tempdir().unwrap();
    let lists = [
        ("rgb.txt", "# color\n1305031102.175304 rgb/a.png\n1305031102.211214 rgb/b.png\n"),
        ("depth.txt", "1305031102.160407 depth/a.png\n1305031102.226738 depth/b.png\n"),
    ];
    for (name, text) in lists {
        fs::write(folder.path().join(name), text).unwrap();
    }
    for (name, text) in lists {
        for (_, damaged) in mutations(text.as_bytes(), 200) {
            fs::write(folder.path().join(name), damaged).unwrap();
            assert!(
                open(&format!("images:{}?layout=tum&associate_s=0.02", folder.path().display())).is_err()
            );
            let _ = describe(folder.path(), None);
        }
        fs::write(folder.path().join(name), text).unwrap();
    }
}

/// Bytes are valid pixels of every uncompressed format (linear ones unless all bits are set); wrong numbers beside them must be refused.
#[test]
fn frames_with_damaged_fields_are_refused_or_converted() {
    const FORMATS: [PixelFormat; 8] = [
        PixelFormat::Yuyv,
        PixelFormat::Uyvy,
        PixelFormat::Nv12,
        PixelFormat::Grey,
        PixelFormat::Y16,
        PixelFormat::Rgb24,
        PixelFormat::RgbF32,
        PixelFormat::Mjpg,
    ];
    let good: Vec<u8> = [8_u32, 4, 24].iter().flat_map(|field| field.to_le_bytes()).collect();
    let mut converter = Converter::new();
    let mut out = vec![0; 8 * 4 * 3];
    let (mut converted, mut refused) = (0, 0);
    for format in FORMATS {
        for (n, fields) in mutations(&good, 300) {
            let field = |at: usize| Some(u32::from_le_bytes(fields.get(at..at + 4)?.try_into().unwrap()));
            let (Some(width_px), Some(height_px), Some(stride_bytes)) = (field(0), field(4), field(8)) else {
                continue;
            };
            // The fields are public: a frame need not have gone through its constructor.
            let mut frame = Frame::packed(PixelFormat::Grey, 1, 1, vec![n as u8; 150]).unwrap();
            (frame.format, frame.width_px, frame.height_px) = (format, width_px, height_px);
            frame.stride_bytes = stride_bytes;
            match converter.rgb24(&frame, &mut out) {
                Ok(()) => converted += 1,
                Err(_) => refused += 1,
            }
            let _ = converter.grey(&frame, &mut out[..32]);
            let _ = (frame.row(height_px.wrapping_sub(1)), frame.chroma_row(height_px / 2));
        }
    }
    assert!(converted > 100 && refused > 500, "{converted} converted, {refused} refused");
}
