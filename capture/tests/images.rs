//! Folders of images as cameras.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests panic as tests do")]

use std::fs;
use std::path::Path;
use std::time::Duration;

use coshade_capture::clock::now;
use coshade_capture::images::{FolderLayout, UnitSource, describe, tum};
use coshade_capture::{
    CaptureError, Control, ControlValue, Converter, DepthFrame, Frame, PixelFormat, SourceRegistry, open,
};
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, LumaA, Rgb, Rgba};

const SOON: Duration = Duration::from_secs(5);

fn grey_8(width: u32, height: u32, value: u8) -> DynamicImage {
    DynamicImage::ImageLuma8(ImageBuffer::from_pixel(width, height, Luma([value])))
}

fn grey_16(width: u32, height: u32, value: u16) -> DynamicImage {
    DynamicImage::ImageLuma16(ImageBuffer::from_fn(width, height, |x, y| Luma([value + (x + 10 * y) as u16])))
}

fn color(width: u32, height: u32, value: u8) -> DynamicImage {
    DynamicImage::ImageRgb8(ImageBuffer::from_fn(width, height, |x, y| Rgb([value, x as u8, y as u8])))
}

fn save(image: &DynamicImage, folder: &Path, name: &str) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    image.save_with_format(&path, ImageFormat::from_path(&path).unwrap()).unwrap();
}

fn uri(folder: &Path, rest: &str) -> String {
    format!("images:{}{rest}", folder.display())
}

/// All frames, as fast as they come.
fn frames(uri: &str) -> Vec<Frame> {
    let mut camera = open(uri).unwrap();
    std::iter::from_fn(|| match camera.next_frame(SOON) {
        Ok(frame) => Some(frame),
        Err(CaptureError::EndOfStream { .. }) => None,
        Err(error) => panic!("{error}"),
    })
    .collect()
}

fn open_error(uri: &str) -> String {
    match open(uri) {
        Ok(_) => panic!("{uri} opened"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_folder_plays_in_natural_order_with_stamps_of_the_rate() {
    let folder = tempfile::tempdir().unwrap();
    for n in [1_u8, 2, 10, 9] {
        save(&grey_8(4, 2, n), folder.path(), &format!("{n}.png"));
    }
    fs::write(folder.path().join("notes.txt"), "no image").unwrap();
    let frames = frames(&uri(folder.path(), "?fps=50&pace=fast"));
    assert_eq!(frames.iter().map(|frame| frame.pixels[0]).collect::<Vec<_>>(), [1, 2, 9, 10]);
    let stamps: Vec<u64> = frames.iter().map(|frame| frame.captured.as_ns()).collect();
    assert_eq!(stamps, [0, 20_000_000, 40_000_000, 60_000_000]);
    assert_eq!(frames.iter().map(|frame| frame.sequence).collect::<Vec<_>>(), [0, 1, 2, 3]);
}

#[test]
fn a_loop_goes_on_counting_and_a_pattern_chooses() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a1.png", "a2.png", "b1.png"] {
        save(&grey_8(4, 2, name.as_bytes()[1]), folder.path(), name);
    }
    let mut camera = open(&uri(folder.path(), "/a?.png?loop=true&pace=fast&fps=10")).unwrap();
    for n in 0..5_u64 {
        let frame = camera.next_frame(SOON).unwrap();
        assert_eq!((frame.sequence, frame.captured.as_ns()), (n, n * 100_000_000));
        assert_eq!(frame.pixels[0], b"12"[(n % 2) as usize]);
    }
}

#[test]
fn real_time_is_kept_and_a_timeout_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for n in 0..4 {
        save(&grey_8(4, 2, n), folder.path(), &format!("{n}.png"));
    }
    let mut camera = open(&uri(folder.path(), "?fps=20")).unwrap();
    let start = now();
    assert_eq!(camera.next_frame(SOON).unwrap().sequence, 0);
    let error = camera.next_frame(Duration::from_millis(5)).unwrap_err();
    assert!(matches!(error, CaptureError::Timeout { .. }), "{error}");
    for n in 1..4 {
        assert_eq!(camera.next_frame(SOON).unwrap().sequence, n);
    }
    // Three periods of 50 ms lie between the first frame and the last.
    assert!(now().saturating_since(start) >= Duration::from_millis(150));
    assert!(matches!(camera.next_frame(SOON), Err(CaptureError::EndOfStream { .. })));
    assert!(matches!(camera.next_frame(SOON), Err(CaptureError::EndOfStream { .. })));
}

#[test]
fn every_kind_of_file_becomes_the_frame_it_holds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let la = ImageBuffer::from_pixel(3, 2, LumaA([7_u8, 0]));
    let rgba = ImageBuffer::from_pixel(3, 2, Rgba([1_u8, 2, 3, 0]));
    let rgb_16 = ImageBuffer::from_pixel(3, 2, Rgb([0_u16, 257, 65535]));
    save(&DynamicImage::ImageLumaA8(la), path, "la.png");
    save(&DynamicImage::ImageRgba8(rgba), path, "rgba.png");
    save(&DynamicImage::ImageRgb16(rgb_16), path, "rgb16.png");
    save(&grey_16(3, 2, 1000), path, "grey16.png");
    fs::write(path.join("grey.pgm"), b"P5 3 2 255\n\x01\x02\x03\x04\x05\x06").unwrap();
    fs::write(path.join("dim.pgm"), b"P2 3 2 100\n0 50 100 0 50 100").unwrap();
    fs::write(path.join("wide.pgm"), b"P2 3 2 1000\n0 500 1000 0 500 1000").unwrap();
    fs::write(path.join("rgb.ppm"), b"P6 3 2 255\nabcdefghijklmnopqr").unwrap();
    let codes = |codes: &[u16]| codes.iter().flat_map(|code| code.to_le_bytes()).collect::<Vec<u8>>();
    for (name, format, pixels) in [
        ("la.png", PixelFormat::Grey, vec![7; 6]),
        ("rgba.png", PixelFormat::Rgb24, [1, 2, 3].repeat(6)),
        ("rgb16.png", PixelFormat::Rgb24, [0, 1, 255].repeat(6)),
        ("grey16.png", PixelFormat::Y16, codes(&[1000, 1001, 1002, 1010, 1011, 1012])),
        ("grey.pgm", PixelFormat::Grey, vec![1, 2, 3, 4, 5, 6]),
        ("dim.pgm", PixelFormat::Grey, [0, 128, 255].repeat(2)),
        ("wide.pgm", PixelFormat::Y16, codes(&[0, 32768, 65535].repeat(2))),
        ("rgb.ppm", PixelFormat::Rgb24, b"abcdefghijklmnopqr".to_vec()),
    ] {
        let found = frames(&uri(path, &format!("/{name}?pace=fast")));
        assert_eq!((found.len(), found[0].format, &*found[0].pixels), (1, format, &*pixels), "{name}");
        assert_eq!((found[0].width_px, found[0].height_px), (3, 2), "{name}");
    }
    let depth = frames(&uri(path, "/wide.pgm?depth_unit_m=0.001&depth_invalid=1000"));
    assert_eq!(depth[0].pixels[..], codes(&[0, 500, 0, 0, 500, 0]), "depth is counts, not stretched");
    let error = open_error(&uri(path, "/grey.pgm?depth_unit_m=0.001"));
    assert!(error.contains("depth must be 16 bit grey, the file is GREY"), "{error}");
}

#[test]
fn jpeg_files_pass_through_undecoded_or_are_decoded_as_asked() {
    let folder = tempfile::tempdir().unwrap();
    save(&color(20, 10, 90), folder.path(), "a.jpg");
    let file = fs::read(folder.path().join("a.jpg")).unwrap();
    let native = &frames(&uri(folder.path(), ""))[0];
    assert_eq!((native.format, &native.pixels[..]), (PixelFormat::Mjpg, &file[..]));
    let mut rgb = vec![0; 600];
    Converter::new().rgb24(native, &mut rgb).unwrap();
    assert_eq!(frames(&uri(folder.path(), "?as=rgb"))[0].pixels[..], rgb);
    let grey = &frames(&uri(folder.path(), "?as=grey"))[0];
    assert_eq!((grey.format, grey.pixels.len()), (PixelFormat::Grey, 200));
}

#[test]
fn mixed_sizes_and_formats_are_refused_with_names_and_figures() {
    let folder = tempfile::tempdir().unwrap();
    save(&grey_8(4, 2, 1), folder.path(), "a.png");
    save(&grey_8(4, 3, 1), folder.path(), "b.png");
    let error = open_error(&uri(folder.path(), ""));
    assert!(
        error.contains("b.png is GREY of 4 x 3 pixels") && error.contains("a.png is GREY of 4 x 2"),
        "{error}"
    );

    save(&color(4, 2, 1), folder.path(), "b.png");
    let error = open_error(&uri(folder.path(), ""));
    assert!(error.contains("b.png is RGB24") && error.contains("as=rgb"), "{error}");
    assert_eq!(frames(&uri(folder.path(), "?as=rgb&pace=fast")).len(), 2);
}

#[test]
fn a_damaged_file_is_one_damaged_frame_and_the_rest_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    for n in 0..4 {
        save(&color(40, 30, n), folder.path(), &format!("{n}.png"));
    }
    fs::write(folder.path().join("1.png"), b"not an image at all").unwrap();
    let whole = fs::read(folder.path().join("2.png")).unwrap();
    fs::write(folder.path().join("2.png"), &whole[..whole.len() / 2]).unwrap();
    let mut camera = open(&uri(folder.path(), "?pace=fast")).unwrap();
    assert_eq!(camera.next_frame(SOON).unwrap().sequence, 0);
    for (sequence, file) in [(1, "1.png"), (2, "2.png")] {
        match camera.next_frame(SOON).unwrap_err() {
            CaptureError::Damaged { sequence: found, reason, .. } => {
                assert_eq!(found, sequence);
                assert!(reason.contains(file), "{reason}");
            }
            other => panic!("{other}"),
        }
    }
    assert_eq!(camera.next_frame(SOON).unwrap().sequence, 3);
}

#[test]
fn what_cannot_be_opened_says_why() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("x.png"), b"").unwrap();
    for (uri, message) in [
        (uri(folder.path(), "/none.png"), "no such file or folder"),
        (uri(folder.path(), "/*.jpg"), "no images (png, jpg"),
        (uri(folder.path(), "/x.png"), "the file is empty"),
        (uri(folder.path(), "/[x.png"), "the pattern is wrong"),
        (uri(folder.path(), "?fsp=3"), "unknown option `fsp`, did you mean `fps`?"),
        (uri(folder.path(), "?layout=tum"), "rgb.txt: cannot be read"),
        ("images:".into(), "names no file"),
        ("image:x".into(), "unknown kind of source `image`, did you mean `images`?"),
        ("http://x".into(), "unknown kind of source `http`, there are: images"),
        ("/dev/video0".into(), "names no kind of source; a source is written like images:"),
    ] {
        let error = open_error(&uri);
        assert!(error.contains(message), "{uri}: {error}");
    }
}

#[test]
fn files_have_no_controls() {
    let folder = tempfile::tempdir().unwrap();
    save(&grey_8(4, 2, 1), folder.path(), "a.png");
    let mut camera = open(&uri(folder.path(), "")).unwrap();
    assert!(camera.controls().is_empty());
    assert!(matches!(camera.control(Control::Gain), Err(CaptureError::NoSuchControl { .. })));
    let set = camera.set_control(Control::Gain, ControlValue::Factor(1.0));
    assert!(matches!(set, Err(CaptureError::NoSuchControl { .. })));
}

#[test]
fn other_schemes_can_be_registered() {
    let mut registry = SourceRegistry::new();
    assert!(registry.open("images:x").is_err());
    registry.register(
        "null",
        "null:",
        Box::new(|rest| Err(CaptureError::EndOfStream { source_name: format!("null {rest}") })),
    );
    assert_eq!(registry.open("null:a:b").err().unwrap().to_string(), "null a:b: end of stream");
    assert_eq!(registry.schemes().collect::<Vec<_>>(), [("null", "null:")]);
}

/// A TUM folder: depth 5 ms behind colour, the second colour image without a partner.
fn tum_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (n, stamp) in ["1305031102.100000", "1305031102.133333", "1305031102.166666"].iter().enumerate() {
        save(&color(4, 2, n as u8), folder.path(), &format!("rgb/{stamp}.png"));
    }
    for (n, stamp) in ["1305031102.105", "1305031102.171666"].iter().enumerate() {
        save(&grey_16(4, 2, 5000 * (n as u16 + 1)), folder.path(), &format!("depth/{stamp}.png"));
    }
    let rgb = "# color images\n1305031102.133333 rgb/1305031102.133333.png\n\
               1305031102.100000 rgb/1305031102.100000.png\n1305031102.166666 rgb/1305031102.166666.png\n";
    let depth = "1305031102.105 depth/1305031102.105.png\n1305031102.171666 depth/1305031102.171666.png\n";
    let truth = "# timestamp tx ty tz qx qy qz qw\n1305031102.1 1 2 3 0 0 0.7071 0.7071\n";
    for (name, text) in [("rgb.txt", rgb), ("depth.txt", depth), ("groundtruth.txt", truth)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

#[test]
fn a_tum_folder_plays_with_the_stamps_of_its_lists() {
    let folder = tum_folder();
    let color = frames(&uri(folder.path(), "?layout=tum&pace=fast"));
    assert_eq!(color.iter().map(|frame| frame.pixels[0]).collect::<Vec<_>>(), [0, 1, 2]);
    assert_eq!(color[1].captured.as_ns(), 1_305_031_102_133_333_000);

    let depth = frames(&uri(folder.path(), "?layout=tum&stream=depth&pace=fast"));
    assert_eq!(depth.len(), 2);
    let depth = DepthFrame::try_from(depth[1].clone()).unwrap();
    assert_eq!(depth.depth_m(0, 0), Some(10_000.0 / 5000.0));
    assert_eq!(depth.depth_m(3, 1), Some(10_013.0 * tum::DEPTH_UNIT_M));

    let partners = frames(&uri(folder.path(), "?layout=tum&pace=fast&associate_s=0.02"));
    assert_eq!(partners.iter().map(|frame| frame.pixels[0]).collect::<Vec<_>>(), [0, 2]);

    // 33.333 ms between the frames on average: so much passes from the last to the first again.
    let mut looped = open(&uri(folder.path(), "?layout=tum&pace=fast&loop=true")).unwrap();
    let stamps: Vec<u64> = (0..4).map(|_| looped.next_frame(SOON).unwrap().captured.as_ns()).collect();
    assert_eq!(stamps[3] - stamps[0], 99_999_000);

    let poses = tum::read_poses(&folder.path().join("groundtruth.txt")).unwrap();
    assert_eq!(poses[0].position_m, [1.0, 2.0, 3.0]);
    assert!((poses[0].rotation_xyzw[2] - 0.5_f64.sqrt()).abs() < 1e-15, "normalised");
}

#[test]
fn errors_in_tum_lists_name_file_and_line() {
    let folder = tum_folder();
    fs::write(folder.path().join("rgb.txt"), "# x\n1.5 a.png\nsoon b.png\n").unwrap();
    let error = open_error(&uri(folder.path(), "?layout=tum"));
    assert!(error.contains("rgb.txt, line 3: `soon` is no time in seconds"), "{error}");
    fs::write(folder.path().join("groundtruth.txt"), "1 1 2 3 0 0 0 0\n").unwrap();
    let error = tum::read_poses(&folder.path().join("groundtruth.txt")).unwrap_err().to_string();
    assert!(error.contains("line 1: the quaternion has length 0"), "{error}");
}

#[test]
fn a_description_tells_layout_figures_and_problems() {
    let folder = tum_folder();
    let tum = describe(folder.path(), None).unwrap();
    assert_eq!((tum.layout, tum.poses), (FolderLayout::Tum, 1));
    let depth = tum.series[1].depth.as_ref().unwrap();
    assert_eq!((depth.unit_source, depth.valid_share, depth.frames_read), (UnitSource::Layout, 1.0, 2));
    assert_eq!((depth.min_m, depth.max_m), (Some(1.0), Some(10_013.0 * 0.0002)));
    for series in &tum.series {
        assert_eq!(frames(&format!("{}&pace=fast", series.uri)).len(), series.frames);
    }

    let folder = tempfile::tempdir().unwrap();
    for n in 0..3 {
        save(&color(4, 2, n), folder.path(), &format!("scan [1]/color_{n}.png"));
    }
    for n in 0..2 {
        let mut image = ImageBuffer::from_pixel(4, 2, Luma([1500_u16]));
        (image[(0, 0)], image[(1, 0)]) = (Luma([0]), Luma([65535]));
        save(&DynamicImage::ImageLuma16(image), folder.path(), &format!("scan [1]/depth_{n}.png"));
    }
    fs::write(folder.path().join("scan [1]/color_1.png"), b"rubbish").unwrap();
    let found = describe(folder.path(), None).unwrap();
    assert_eq!(found.layout, FolderLayout::ColorAndDepth);
    assert_eq!(found.series.iter().map(|series| series.frames).collect::<Vec<_>>(), [3, 2]);
    let depth = found.series[1].depth.as_ref().unwrap();
    assert_eq!(
        (depth.unit_source, depth.valid_share, depth.median_m),
        (UnitSource::Assumed, 7.0 / 8.0, Some(1.5))
    );
    for wanted in ["color_1.png", "3 images but 2 depth images", "12.5 % of the pixels hold 65535"] {
        assert!(
            found.problems.iter().any(|problem| problem.contains(wanted)),
            "{wanted}: {:?}",
            found.problems
        );
    }
    assert_eq!(frames(&format!("{}&pace=fast", found.series[1].uri)).len(), 2, "{}", found.series[1].uri);
    assert!(describe(&folder.path().join("none"), None).is_err());
}

#[test]
fn folders_called_depth_hold_depth_and_other_sixteen_bit_images_do_not() {
    let folder = tempfile::tempdir().unwrap();
    for n in 0..2 {
        save(&grey_16(4, 2, 700), folder.path(), &format!("Depth/{n}.png"));
        save(&grey_16(4, 2, 700), folder.path(), &format!("infrared/{n}.png"));
    }
    let found = describe(folder.path(), None).unwrap();
    let formats: Vec<_> = found.series.iter().map(|series| series.format).collect();
    assert_eq!(formats, [PixelFormat::Z16, PixelFormat::Y16]);
    assert_eq!(found.problems, Vec::<String>::new());
    let given = describe(&folder.path().join("infrared"), Some(0.001)).unwrap();
    assert_eq!(given.series[0].depth.as_ref().unwrap().max_m, Some(0.713));
}

#[test]
fn real_rgbd_sets_are_recognised_and_open() {
    let Some(root) = coshade_testdata::find("real_rgbd_sets_are_recognised_and_open", "rgbd") else { return };
    // Read with Pillow and NumPy: valid pixels of all; smallest, median and largest code.
    for (name, layout, unit_m, size, valid, codes) in [
        ("tsdf-fusion-python-7scenes-redkitchen", FolderLayout::SevenScenes, None, [640, 480], 0.0, [0; 3]),
        (
            "slambook2-ch5",
            FolderLayout::ColorAndDepth,
            Some(0.001),
            [640, 480],
            645_339.0 / 921_600.0,
            [946, 2799, 9823],
        ),
        (
            "apriltags-rgbd-kinect2",
            FolderLayout::ColorAndDepth,
            Some(0.001),
            [960, 540],
            1_479_882.0 / 3_110_400.0,
            [483, 1332, 11_023],
        ),
        (
            "open3d-singles",
            FolderLayout::ColorAndDepth,
            Some(0.0002),
            [640, 480],
            248_250.0 / 307_200.0,
            [7320, 12_075, 46_655],
        ),
    ] {
        let found = describe(&root.join(name), unit_m).unwrap();
        assert_eq!(found.layout, layout, "{name}");
        assert_eq!(found.problems, Vec::<String>::new(), "{name}");
        assert_eq!(found.series.len(), 2, "{name}");
        for series in &found.series {
            assert_eq!([series.width_px, series.height_px], size, "{name}");
            // Of the longest set only some images are read: no figures to compare.
            if let Some(depth) = series.depth.as_ref().filter(|depth| depth.frames_read == series.frames) {
                assert_eq!(depth.valid_share, valid, "{name}");
                let found = [depth.min_m, depth.median_m, depth.max_m];
                assert_eq!(found, codes.map(|code| Some(f64::from(code) * depth.unit_m)), "{name}");
            }
            let separator = if series.uri.contains("?depth") { '&' } else { '?' };
            let mut camera = open(&format!("{}{separator}pace=fast", series.uri)).unwrap();
            let frame = camera.next_frame(SOON).unwrap();
            assert_eq!((frame.format, frame.depth_unit_m.is_some()), (series.format, series.depth.is_some()));
            if let Ok(depth) = DepthFrame::try_from(frame) {
                assert!(depth.row_codes(240).any(|code| code > 0), "{name}");
            }
        }
    }
    // Read as millimetres, a depth image of TUM shows half of a room beyond 12 m.
    let assumed = describe(&root.join("open3d-singles"), None).unwrap();
    assert!(
        assumed.problems.iter().any(|problem| problem.contains("0.0002 (TUM)")),
        "{:?}",
        assumed.problems
    );
}
