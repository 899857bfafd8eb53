//! Recordings come back as they were, whole, cut, and after a crash.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may panic")]

mod support;

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use coshade_capture::recording::{
    Compression, Reader, RecordedTransform, Recorder, RecordingError, RecordingOptions, RecordingWriter,
    describe,
};
use coshade_capture::{Frame, PixelFormat, Timestamp, clock};
use coshade_lens::calibration::Calibration;
use support::{FORMATS, Random, assert_same, frame, read_all, record_all, small_chunks};

/// Each frame that was read is the one that was written, and they are in order.
fn assert_prefix(frames: &[coshade_capture::recording::RecordedFrame]) {
    for (index, read) in frames.iter().enumerate() {
        let format = FORMATS[index % FORMATS.len()];
        assert_same(&read.frame, &frame(format, (index / FORMATS.len()) as u64));
        assert_eq!(read.logged, read.frame.captured);
    }
}

#[test]
fn thousands_of_frames_of_all_formats_come_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let path = folder.path().join(format!("{compression:?}.mcap"));
        record_all(&path, small_chunks(compression), 250);
        let (frames, errors) = read_all(&path);
        assert_eq!(errors, Vec::<String>::new());
        assert_eq!(frames.len(), 250 * FORMATS.len());
        assert_prefix(&frames);
        let description = describe(&path).unwrap();
        assert!(description.indexed && description.damage.is_empty());
        assert_eq!(description.streams.len(), FORMATS.len());
        for stream in &description.streams {
            assert_eq!((stream.frames, stream.missing, stream.dropped), (250, 24, Some(0)));
            // 249 intervals of 10 ms, jittered by less than 1 ms at both ends.
            let rate = stream.frames_per_second.unwrap();
            assert!((rate - 100.0).abs() < 100.0 / 2490.0 + 0.01, "{rate}");
        }
        serde_json::to_string(&description).unwrap();
    }
}

#[test]
fn a_stream_may_change_between_raw_and_jpeg() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mixed.mcap");
    let mut writer = RecordingWriter::create(&path, RecordingOptions::default()).unwrap();
    let stream = writer.add_stream("camera", None, Some(30.0)).unwrap();
    let written: Vec<Frame> =
        (0..45).map(|index| frame(FORMATS[index % FORMATS.len()], index as u64)).collect();
    written.iter().for_each(|frame| writer.write(stream, frame, 7).unwrap());
    writer.finish(&[9]).unwrap();
    let reader = Reader::open(&path).unwrap();
    assert_eq!(reader.streams().len(), 1);
    assert_eq!(reader.streams()[0].frames_per_second, Some(30.0));
    let (frames, errors) = read_all(&path);
    assert!(errors.is_empty(), "{errors:?}");
    assert_eq!(frames.len(), 45);
    frames.iter().zip(&written).for_each(|(read, written)| assert_same(&read.frame, written));
    assert!(frames.iter().all(|read| read.dropped_before == 7));
    assert_eq!(describe(&path).unwrap().streams[0].dropped, Some(9));
}

#[test]
fn calibration_poses_and_session_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    let mut calibration = Calibration::default_for([640, 480], 1.1).unwrap();
    calibration.readout_s = 0.1 + 0.2; // no short decimal
    let session = "version = 1\n# \"ümläut\" and a tab\t\n".to_owned();
    let options = RecordingOptions { session: Some(session.clone()), ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(&path, options).unwrap();
    let stream = writer.add_stream("camera", Some(&calibration), None).unwrap();
    writer.add_stream("fisheye", None, None).unwrap();
    let pose = RecordedTransform {
        stamp: Timestamp::from_ns(123_456_789_012),
        parent: "world".into(),
        child: "camera".into(),
        translation_m: [0.1, -2.0, 1e-300],
        rotation_xyzw: [0.5, -0.5, 0.5, 0.1 + 0.2],
    };
    writer.write_transform(&pose).unwrap();
    writer.write(stream, &frame(PixelFormat::Yuyv, 0), 0).unwrap();
    writer.finish(&[0, 0]).unwrap();

    let mut reader = Reader::open(&path).unwrap();
    assert_eq!(reader.calibration(0).unwrap().unwrap(), calibration);
    assert_eq!(reader.transforms().unwrap(), [pose]);
    let description = describe(&path).unwrap();
    assert_eq!(description.session["session"], session);
    assert!(description.session["start_unix_ns"].parse::<u128>().unwrap() > 1_600_000_000_000_000_000);
    let intrinsics = description.streams[0].intrinsics.clone().unwrap();
    let expected = calibration.model.intrinsics();
    assert_eq!(intrinsics.fx_fy_cx_cy_px, [expected.fx, expected.fy, expected.cx, expected.cy]);
    assert_eq!(intrinsics.distortion_model, "plumb_bob");
    assert!(description.streams[0].calibration);
    assert_eq!(description.attachments, ["camera/calibration.toml"]);
}

#[test]
fn a_cut_recording_is_readable_up_to_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let whole = folder.path().join(format!("{compression:?}.mcap"));
        record_all(&whole, small_chunks(compression), 40);
        let bytes = std::fs::read(&whole).unwrap();
        let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
        let mut random = Random(7);
        let anywhere = (0..100).map(|_| 100 + random.below(bytes.len() as u64 - 100) as usize);
        // In the second of the index records behind a chunk (31 bytes or more each): it may define more channels than the
        // first says.
        let in_indexes =
            chunks.iter().take(12).map(|c| (c.chunk_start_offset + c.chunk_length) as usize + 40);
        for cut in in_indexes.chain(anywhere) {
            let path = folder.path().join("cut.mcap");
            std::fs::write(&path, &bytes[..cut]).unwrap();
            let (frames, errors) = read_all(&path);
            assert_eq!(errors, Vec::<String>::new(), "a cut is no damage in between");
            assert_prefix(&frames);
            let complete = chunks.iter().filter(|c| c.chunk_start_offset + c.chunk_length <= cut as u64);
            let expected: usize = complete.map(|chunk| images_in(&bytes, chunk)).sum();
            assert!(frames.len() >= expected, "{} of {expected} frames at {cut}", frames.len());
            let description = describe(&path).unwrap();
            let last_chunk = chunks.last().unwrap();
            if cut < (last_chunk.chunk_start_offset + last_chunk.chunk_length) as usize {
                assert!(!description.indexed);
                let named =
                    description.damage.iter().any(|d| d.offset <= cut as u64 && d.what.contains("end"));
                assert!(named, "{:?}", description.damage);
            }
        }
    }
}

/// Frames in a chunk, counted by the `mcap` crate: channels alternate between descriptions and images.
fn images_in(bytes: &[u8], chunk: &mcap::records::ChunkIndex) -> usize {
    let start = chunk.chunk_start_offset as usize;
    let records = mcap::read::LinearReader::sans_magic(&bytes[start..start + chunk.chunk_length as usize]);
    let messages = records.filter(|record| matches!(record, Ok(mcap::records::Record::Message { .. })));
    let count = messages.count();
    count / 2
}

#[test]
fn a_partly_written_chunk_gives_its_first_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one_chunk.mcap");
    let options = RecordingOptions {
        compression: Compression::None,
        chunk_bytes: 1 << 30,
        ..small_chunks(Compression::None)
    };
    record_all(&path, options, 40);
    let bytes = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let chunk = summary.chunk_indexes.iter().max_by_key(|chunk| chunk.chunk_length).unwrap();
    let indexes = summary.read_message_indexes(&bytes, chunk).unwrap();
    let mut offsets: Vec<u64> = indexes.values().flatten().map(|entry| entry.offset).collect();
    offsets.sort_unstable();
    let data_start = chunk.compressed_data_offset().unwrap();
    let cut = data_start + chunk.compressed_size / 2;
    std::fs::write(&path, &bytes[..cut as usize]).unwrap();
    let (frames, _) = read_all(&path);
    // A message is complete if the next one begins before the cut; each frame is two messages, and channels are
    // defined between messages only for the first eight frames.
    let complete = offsets.iter().skip(1).filter(|&&offset| data_start + offset <= cut).count();
    assert!(complete > 300);
    assert_eq!(frames.len(), complete / 2);
    assert_prefix(&frames);
}

#[test]
fn flipped_bytes_are_found_and_the_rest_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole.mcap");
    record_all(&whole, small_chunks(Compression::Lz4), 40);
    let bytes = std::fs::read(&whole).unwrap();
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let mut random = Random(11);
    let mut crc_named = 0;
    for _ in 0..100 {
        let mut damaged = bytes.clone();
        let at = random.below(bytes.len() as u64) as usize;
        damaged[at] ^= 1 << random.below(8);
        let path = folder.path().join("flipped.mcap");
        std::fs::write(&path, &damaged).unwrap();
        if at < 8 {
            assert!(matches!(Reader::open(&path), Err(RecordingError::Format { .. })));
            continue;
        }
        let (frames, errors) = read_all(&path);
        for read in &frames {
            let index = (read.frame.sequence - (1 << 40)) * 10 / 11;
            let original = (index.saturating_sub(1)..=index + 1).map(|index| frame(read.frame.format, index));
            let original = original.into_iter().find(|frame| frame.sequence == read.frame.sequence).unwrap();
            assert_same(&read.frame, &original);
        }
        let hit = chunks
            .iter()
            .find(|c| (c.chunk_start_offset..c.chunk_start_offset + c.chunk_length).contains(&(at as u64)));
        if let Some(chunk) = hit {
            // At most this chunk is lost; if it held anything, that is said with its place.
            assert!(frames.len() >= 320 - images_in(&bytes, chunk), "{} frames, byte {at}", frames.len());
            if frames.len() < 320 {
                let place = format!("flipped.mcap: damaged at byte {}", chunk.chunk_start_offset);
                assert!(errors.iter().any(|error| error.contains(&place)), "{errors:?}");
            }
            crc_named += usize::from(errors.iter().any(|error| error.contains("CRC")));
        } else {
            assert!(frames.len() >= 320, "{} frames, byte {at}", frames.len());
        }
    }
    assert!(crc_named > 40, "{crc_named}");
}

#[test]
fn nothing_is_overwritten_unasked_and_bad_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    std::fs::write(&path, "precious").unwrap();
    let error = RecordingWriter::create(&path, RecordingOptions::default()).err().unwrap();
    assert!(
        matches!(error, RecordingError::Exists { .. }) && error.to_string().contains("a.mcap"),
        "{error}"
    );
    assert_eq!(std::fs::read(&path).unwrap(), b"precious");
    let options = RecordingOptions { overwrite: true, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(&path, options).unwrap();
    for name in ["", "a/b", "a#b", "ä", "a b"] {
        assert!(matches!(writer.add_stream(name, None, None), Err(RecordingError::Name { .. })), "{name}");
    }
    writer.add_stream("a", None, None).unwrap();
    assert!(matches!(writer.add_stream("a", None, None), Err(RecordingError::Name { .. })));
    let nowhere = folder.path().join("no/such/folder.mcap");
    assert!(matches!(
        RecordingWriter::create(nowhere, RecordingOptions::default()),
        Err(RecordingError::Create { .. })
    ));
}

#[test]
fn a_frame_that_contradicts_itself_is_not_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer = RecordingWriter::create(&path, RecordingOptions::default()).unwrap();
    let stream = writer.add_stream("a", None, None).unwrap();
    let mut infinite = frame(PixelFormat::RgbF32, 1);
    infinite.pixels = vec![0xff; infinite.pixels.len()].into();
    let error = writer.write(stream, &infinite, 0).unwrap_err();
    assert!(error.to_string().contains("pixel (0, 0): red is NaN"), "{error}");
    let mut bad = frame(PixelFormat::Yuyv, 1);
    bad.height_px *= 2;
    assert!(matches!(writer.write(stream, &bad, 0), Err(RecordingError::Frame { .. })));
    writer.write(stream, &frame(PixelFormat::Yuyv, 2), 0).unwrap();
    writer.finish(&[0]).unwrap();
    assert_eq!(read_all(&path).0.len(), 1);
}

#[test]
fn the_recorder_drops_and_counts_instead_of_waiting() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let recorder = Recorder::create(&path, RecordingOptions::default(), 4).unwrap();
    let stream = recorder.add_stream("camera", None, None).unwrap();
    let large = Frame::packed(PixelFormat::Grey, 4096, 2048, vec![7; 4096 * 2048]).unwrap();
    let mut refused = 0;
    let mut slowest = Duration::ZERO;
    for index in 0..200 {
        let mut frame = large.clone();
        frame.sequence = index;
        let start = clock::now();
        refused += u64::from(!recorder.try_record(stream, frame));
        slowest = slowest.max(clock::now().saturating_since(start));
    }
    // 200 frames of 8 MiB through a queue of 4: writing one takes longer than giving one.
    assert!(refused > 0);
    assert_eq!(recorder.dropped(stream), refused);
    assert!(slowest < Duration::from_millis(200), "{slowest:?}");
    let counts = recorder.finish().unwrap();
    assert_eq!((counts[0].written, counts[0].dropped), (200 - refused, refused));
    let description = describe(&path).unwrap();
    assert_eq!(description.streams[0].frames, 200 - refused);
    assert_eq!(description.streams[0].dropped, Some(refused));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_once_with_the_path() {
    let options = RecordingOptions { overwrite: true, ..RecordingOptions::default() };
    let error = Recorder::create("/dev/full", options, 4).err().unwrap();
    assert!(error.to_string().contains("/dev/full") && error.to_string().contains("space"), "{error}");
}

/// Not a test of its own: what [`a_killed_recorder_loses_less_than_a_second`] runs in another process.
#[test]
fn child_that_records_until_it_is_killed() {
    let Some(path) = std::env::var_os("COSHADE_TEST_RECORD_TO") else { return };
    let recorder = Recorder::create(Path::new(&path), RecordingOptions::default(), 16).unwrap();
    let stream = recorder.add_stream("camera", None, None).unwrap();
    let start = clock::now();
    for index in 0.. {
        std::thread::sleep(Duration::from_millis(10));
        let mut frame = frame(PixelFormat::Yuyv, index);
        frame.captured = Timestamp::from_ns(clock::now().saturating_since(start).as_nanos() as u64);
        assert!(recorder.try_record(stream, frame));
        if clock::now().saturating_since(start) > Duration::from_secs(2) {
            // As a crash: no destructors, nothing is flushed.
            std::process::abort();
        }
    }
}

#[test]
fn a_killed_recorder_loses_less_than_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("crash.mcap");
    let status = Command::new(std::env::current_exe().unwrap())
        .args(["child_that_records_until_it_is_killed", "--exact", "--nocapture"])
        .env("COSHADE_TEST_RECORD_TO", &path)
        .output()
        .unwrap()
        .status;
    assert!(!status.success());
    let (frames, errors) = read_all(&path);
    assert!(errors.is_empty(), "{errors:?}");
    let last = frames.last().unwrap().frame.captured.as_secs_f64();
    assert!(last > 1.0, "the last frame is of {last} s, the crash was at 2 s");
    for (index, read) in frames.iter().enumerate() {
        assert_eq!(read.frame.pixels, frame(PixelFormat::Yuyv, index as u64).pixels);
    }
    let description = describe(&path).unwrap();
    assert!(!description.indexed && !description.damage.is_empty());
}
