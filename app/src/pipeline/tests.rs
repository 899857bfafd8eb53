//! The pipeline with cameras and trackers that fail as told.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use coshade_capture::control::{Control, ControlInfo, ControlReport, ControlValue};
use coshade_capture::{
    Camera, CaptureError, ColorEncoding, Frame, LatestError, PixelFormat, StreamInfo, Timestamp, clock,
};
use coshade_tracker::Luma;

use super::*;
use crate::sources;

/// A guard against hanging, far above what anything here takes.
const HANG: Duration = Duration::from_secs(20);

/// What a camera does when asked for a frame.
#[derive(Clone, Copy, Debug)]
enum Step {
    Frame,
    /// Of another size than announced.
    OtherSize,
    /// An MJPG frame that is no JPEG image.
    Garbage,
    Damaged,
    /// Nothing for so many milliseconds.
    Nothing(u64),
    Lost,
    Panic,
}
use Step::*;

/// Plays a script; at its end, the stream is over.
struct Scripted {
    stream: StreamInfo,
    steps: VecDeque<Step>,
    sequence: u64,
    live: bool,
}

impl Scripted {
    fn new(steps: impl IntoIterator<Item = Step>) -> Self {
        let stream = StreamInfo {
            format: PixelFormat::Grey,
            color: ColorEncoding::default(),
            width_px: 8,
            height_px: 4,
            frames_per_second: Some(100.0),
            depth_unit_m: None,
        };
        Self { stream, steps: steps.into_iter().collect(), sequence: 0, live: false }
    }

    /// Every pixel is the frame's number.
    fn frame(&mut self, format: PixelFormat, width_px: u32) -> Frame {
        let (stride, bytes) = (if format == PixelFormat::Mjpg { 0 } else { width_px }, width_px as usize * 4);
        let frame = Frame::new(format, width_px, 4, stride, vec![self.sequence as u8; bytes]).unwrap();
        let captured = Timestamp::from_ns(self.sequence * 10_000_000);
        self.sequence += 1;
        Frame { captured, sequence: self.sequence - 1, ..frame }
    }
}

impl Camera for Scripted {
    fn name(&self) -> &str {
        "scripted:"
    }

    fn stream(&self) -> &StreamInfo {
        &self.stream
    }

    fn is_live(&self) -> bool {
        self.live
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CaptureError> {
        let source_name = self.name().to_owned();
        let Some(step) = self.steps.pop_front() else {
            return Err(CaptureError::EndOfStream { source_name });
        };
        match step {
            Frame => Ok(self.frame(PixelFormat::Grey, 8)),
            OtherSize => Ok(self.frame(PixelFormat::Grey, 6)),
            Garbage => Ok(self.frame(PixelFormat::Mjpg, 8)),
            Damaged => {
                Err(CaptureError::Damaged { source_name, sequence: self.sequence, reason: "torn".into() })
            }
            Nothing(ms) if ms > timeout.as_millis() as u64 => {
                self.steps.push_front(Nothing(ms - timeout.as_millis() as u64));
                std::thread::sleep(timeout);
                Err(CaptureError::Timeout { source_name, timeout })
            }
            Nothing(ms) => {
                std::thread::sleep(Duration::from_millis(ms));
                Ok(self.frame(PixelFormat::Grey, 8))
            }
            Lost => Err(CaptureError::Lost { source_name, reason: "unplugged".into() }),
            Panic => panic!("driver bug"),
        }
    }

    fn controls(&self) -> Vec<ControlInfo> {
        Vec::new()
    }

    fn control(&mut self, control: Control) -> Result<ControlValue, CaptureError> {
        Err(CaptureError::NoSuchControl { source_name: self.name().to_owned(), control })
    }

    fn set_control(&mut self, control: Control, _: ControlValue) -> Result<ControlReport, CaptureError> {
        Err(CaptureError::NoSuchControl { source_name: self.name().to_owned(), control })
    }
}

/// A camera that plays one script after the other, each once it is opened anew; `None` cannot be opened.
fn source(first: Scripted, later: impl IntoIterator<Item = Option<Scripted>>) -> Source {
    let mut later: VecDeque<_> = later.into_iter().collect();
    let open = move || match later.pop_front().flatten() {
        Some(camera) => Ok(Box::new(camera) as Box<dyn Camera>),
        None => Err(CaptureError::Lost { source_name: "scripted:".into(), reason: "no such device".into() }),
    };
    Source { camera: Box::new(first), open: Box::new(open) }
}

/// The code of the first pixel, which is the frame's number; panics on the numbers it is told to.
#[derive(Clone, Default)]
struct FirstPixel {
    panics_on: Vec<u8>,
    takes: Duration,
}

impl Track for FirstPixel {
    type Tracking = Option<u8>;

    fn track(&mut self, image: &Luma<'_>, _: Timestamp) -> Option<u8> {
        std::thread::sleep(self.takes);
        let code = image.get(0, 0);
        assert!(!code.is_some_and(|code| self.panics_on.contains(&code)), "tracker bug");
        code
    }
}

const EVERY: Options =
    Options { handover: Handover::Every, retry: Retry::Never, only_frame: None, max_frames: None };
const LIVE: Options =
    Options { handover: Handover::Newest, retry: Retry::UntilStopped, only_frame: None, max_frames: None };

fn start(source: Source, tracker: FirstPixel, options: Options) -> Pipeline<Option<u8>> {
    Pipeline::start(source, move || Ok(tracker.clone()), options).unwrap()
}

/// All frames to the end of the stream, by number, and how it ended.
fn run(source: Source, tracker: FirstPixel, options: Options) -> (Vec<u64>, Finished) {
    let mut pipeline = start(source, tracker, options);
    let hang = clock::now() + HANG;
    let mut numbers = Vec::new();
    loop {
        match pipeline.receive(Duration::from_millis(100)) {
            Ok(tracked) => {
                assert_eq!(tracked.tracking, Some(tracked.frame.sequence as u8), "of another frame");
                numbers.push(tracked.frame.sequence);
            }
            Err(LatestError::Timeout) => assert!(clock::now() < hang, "hangs"),
            Err(LatestError::Closed) => return (numbers, pipeline.finish()),
        }
    }
}

fn said(finished: &Finished, text: &str) -> bool {
    finished.events.iter().any(|event| event.message.contains(text))
}

#[test]
fn every_frame_of_a_file_is_tracked_however_slow_the_tracker() {
    let slow = FirstPixel { takes: Duration::from_millis(2), ..FirstPixel::default() };
    let (numbers, finished) = run(source(Scripted::new([Frame; 100]), []), slow, EVERY);
    assert_eq!(numbers, Vec::from_iter(0..100));
    let metrics = finished.metrics;
    assert_eq!((metrics.frames_in, metrics.tracked, metrics.overwritten, metrics.unread), (100, 100, 0, 0));
    assert!(finished.failures.is_empty() && finished.events.is_empty());
    // Tracking is a part of the latency; a sleep is never shorter than asked for (quantiles are right to 1 %).
    let (track, latency) = (metrics.track_ms.unwrap(), metrics.latency_ms.unwrap());
    assert!(track.median > 2.0 * 0.98 && latency.median >= track.median * 0.98, "{track:?} {latency:?}");
    assert_eq!(metrics.capture_latency_ms, None, "the stamps of a file are of another clock");
}

#[test]
fn a_slow_tracker_of_a_live_camera_gets_newer_frames_and_the_rest_is_counted() {
    let slow = FirstPixel { takes: Duration::from_millis(20), ..FirstPixel::default() };
    let live = Scripted { live: true, ..Scripted::new([Nothing(2); 100]) };
    let (numbers, finished) = run(source(live, []), slow, LIVE);
    assert!(numbers.is_sorted() && numbers.last() == Some(&99), "{numbers:?}");
    let metrics = finished.metrics;
    assert!(metrics.overwritten > 0);
    assert_eq!(metrics.tracked + metrics.overwritten, 100);
    assert_eq!(numbers.len() as u64 + metrics.unread, metrics.tracked);
    assert!(metrics.capture_latency_ms.is_some());
}

#[test]
fn a_camera_that_vanishes_is_opened_again_and_tracking_goes_on() {
    let back = Scripted { sequence: 50, ..Scripted::new([Frame; 3]) };
    let camera = source(Scripted::new([Frame, Frame, Lost]), [None, Some(back)]);
    let begun = clock::now();
    let (numbers, finished) =
        run(camera, FirstPixel::default(), Options { retry: Retry::UntilStopped, ..EVERY });
    assert_eq!(numbers, [0, 1, 50, 51, 52]);
    assert!(clock::now().saturating_since(begun) >= Duration::from_millis(250 + 500), "without a pause");
    assert!(finished.failures.is_empty());
    assert_eq!((finished.metrics.lost, finished.metrics.missing), (1, 0));
    for text in ["unplugged", "no such device", "frames again after"] {
        assert!(said(&finished, text), "{text}: {:?}", finished.events);
    }
    let times: Vec<_> = finished.events.iter().map(|event| event.at).collect();
    assert!(times.is_sorted());
}

#[test]
fn a_camera_that_comes_and_goes_is_opened_ever_more_rarely() {
    let once = || Some(Scripted::new([Frame, Lost]));
    let camera = source(Scripted::new([Lost]), [once(), once(), Some(Scripted::new([Frame]))]);
    let begun = clock::now();
    let (_, finished) = run(camera, FirstPixel::default(), Options { retry: Retry::UntilStopped, ..EVERY });
    assert_eq!(finished.metrics.lost, 3);
    assert!(clock::now().saturating_since(begun) >= Duration::from_millis(250 + 500 + 1000));
}

#[test]
fn a_file_that_breaks_off_is_not_read_twice() {
    let camera = source(Scripted::new([Frame, Frame, Lost]), [Some(Scripted::new([Frame]))]);
    let (numbers, finished) = run(camera, FirstPixel::default(), EVERY);
    assert_eq!(numbers, [0, 1], "what was there is tracked");
    assert_eq!(format!("{:#}", finished.failures[0]), "thread `camera`: scripted:: unplugged");
    assert_eq!(finished.metrics.camera, CameraState::Lost);
}

#[test]
fn a_driver_that_panics_is_opened_again_or_ends_it_with_its_name() {
    let camera = || source(Scripted::new([Frame, Panic]), [Some(Scripted::new([Frame; 2]))]);
    let (numbers, finished) =
        run(camera(), FirstPixel::default(), Options { retry: Retry::UntilStopped, ..EVERY });
    assert_eq!((numbers.len(), finished.metrics.restarts), (3, 1));
    assert!(said(&finished, "its driver has panicked: driver bug"));
    let (numbers, finished) = run(camera(), FirstPixel::default(), EVERY);
    assert_eq!(numbers, [0]);
    let failure = format!("{:#}", finished.failures[0]);
    assert!(failure.contains("thread `camera`") && failure.contains("driver bug"), "{failure}");
}

#[test]
fn stalls_and_their_ends_are_reported() {
    // 100 frames a second: a stall from a quarter of a second on.
    let (numbers, finished) = run(
        source(Scripted::new([Frame, Nothing(400), Frame, Nothing(100)]), []),
        FirstPixel::default(),
        LIVE,
    );
    assert_eq!(numbers.last(), Some(&3));
    assert_eq!(finished.metrics.stalls, 1, "{:?}", finished.events);
    assert!(said(&finished, "stalled, no frame for") && said(&finished, "frames again after"));
}

#[test]
fn damaged_frames_are_counted_and_left_out() {
    let script = [Frame, Damaged, OtherSize, Garbage, Frame];
    let (numbers, finished) = run(source(Scripted::new(script), []), FirstPixel::default(), EVERY);
    assert_eq!(numbers, [0, 3]);
    assert_eq!(finished.metrics.damaged, 3);
    assert!(said(&finished, "torn"), "{:?}", finished.events);
}

#[test]
fn a_panic_of_the_tracker_costs_one_frame() {
    let tracker = FirstPixel { panics_on: vec![3, 7], ..FirstPixel::default() };
    let (numbers, finished) = run(source(Scripted::new([Frame; 10]), []), tracker, EVERY);
    assert_eq!(numbers, [0, 1, 2, 4, 5, 6, 8, 9]);
    assert_eq!(finished.metrics.restarts, 2);
    assert!(said(&finished, "the tracker has panicked on frame 3: tracker bug"));
    assert!(finished.failures.is_empty());
}

#[test]
fn a_tracker_that_always_panics_ends_it() {
    let tracker = FirstPixel { panics_on: vec![2, 3, 4], ..FirstPixel::default() };
    let (numbers, finished) = run(source(Scripted::new([Frame; 100]), []), tracker, EVERY);
    assert_eq!(numbers, [0, 1]);
    let failure = format!("{:#}", finished.failures[0]);
    assert!(failure.contains("thread `tracker`") && failure.contains("tracker bug"), "{failure}");
}

#[test]
fn a_tracker_that_cannot_be_made_again_ends_it() {
    let built = AtomicU64::new(0);
    let build = move || match built.fetch_add(1, Ordering::Relaxed) {
        0 => Ok(FirstPixel { panics_on: vec![1], ..FirstPixel::default() }),
        _ => anyhow::bail!("no memory"),
    };
    let mut pipeline = Pipeline::start(source(Scripted::new([Frame; 9]), []), build, EVERY).unwrap();
    while pipeline.receive(HANG).is_ok() {}
    let failure = format!("{:#}", pipeline.finish().failures[0]);
    assert_eq!(failure, "thread `tracker`: the tracker cannot be started again: no memory");
}

#[test]
fn it_ends_in_time_whatever_it_waits_for() {
    let endless = || std::iter::repeat_n(Frame, 100_000);
    let lost = || source(Scripted::new([Lost]), []);
    let waiting: [(&str, Source, Options); 4] = [
        ("a camera without frames", source(Scripted::new([Nothing(3_600_000)]), []), LIVE),
        ("a camera that is gone", lost(), LIVE),
        ("a reader that takes nothing", source(Scripted::new(endless()), []), EVERY),
        ("nothing", source(Scripted::new(endless()), []), LIVE),
    ];
    for (what, source, options) in waiting {
        let pipeline = start(source, FirstPixel::default(), options);
        std::thread::sleep(Duration::from_millis(100));
        let begun = clock::now();
        let finished = pipeline.finish();
        let took = clock::now().saturating_since(begun);
        assert!(took < STOP_WITHIN + Duration::from_millis(100), "{what}: {took:?}");
        assert!(finished.failures.is_empty(), "{what}: {:?}", finished.failures);
    }
}

#[test]
fn one_frame_can_be_asked_for_by_its_number() {
    let only = |number| Options { only_frame: Some(number), ..EVERY };
    let camera = || source(Scripted { sequence: 10, ..Scripted::new([Frame; 5]) }, []);
    let (numbers, finished) = run(camera(), FirstPixel::default(), only(12));
    assert_eq!(numbers, [12]);
    assert!(finished.failures.is_empty(), "{:?}", finished.failures);
    for number in [3, 15] {
        let (numbers, finished) = run(camera(), FirstPixel::default(), only(number));
        assert!(numbers.is_empty());
        let failure = format!("{:#}", finished.failures[0]);
        assert!(failure.contains(&format!("no frame {number}: they are numbered 10 to ")), "{failure}");
    }
}

#[test]
fn it_ends_after_the_frames_that_are_wanted() {
    let endless = source(Scripted::new(std::iter::repeat_n(Frame, 100_000)), []);
    let (numbers, finished) = run(endless, FirstPixel::default(), Options { max_frames: Some(3), ..EVERY });
    assert_eq!((numbers, finished.metrics.tracked), (vec![0, 1, 2], 3));
    assert!(finished.failures.is_empty(), "{:?}", finished.failures);
}

#[test]
fn it_says_how_the_camera_is() {
    let script = [Frame, Nothing(400), Nothing(200), Lost];
    let mut pipeline = start(source(Scripted::new(script), []), FirstPixel::default(), LIVE);
    let hang = clock::now() + HANG;
    for state in [CameraState::Delivering, CameraState::Stalled, CameraState::Delivering, CameraState::Lost] {
        while pipeline.camera() != state {
            assert!(clock::now() < hang, "never {state:?}");
            let _ = pipeline.receive(Duration::from_millis(1));
        }
    }
}

/// Everything that frames of one size need is there after the first few: their pixels are shared, the brightness of other
/// formats goes into the same memory.
#[test]
fn a_plane_of_brightness_is_not_copied() {
    struct Address;
    impl Track for Address {
        type Tracking = usize;

        fn track(&mut self, image: &Luma<'_>, _: Timestamp) -> usize {
            image.bytes().as_ptr() as usize
        }
    }
    let mut pipeline = Pipeline::start(source(Scripted::new([Frame; 5]), []), || Ok(Address), EVERY).unwrap();
    while let Ok(tracked) = pipeline.receive(HANG) {
        assert_eq!(tracked.tracking, tracked.frame.pixels.as_ptr() as usize);
    }
}

/// Simulated sensors, whose faults are known: the world of the crate `sim`'s tests, 5 frames, of which one is dropped.
fn simulated(edit: impl Fn(&str) -> String) -> (tempfile::TempDir, Source) {
    let folder = tempfile::tempdir().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sim/tests/data");
    let world = std::fs::read_to_string(data.join("desk.toml")).unwrap();
    let edited = edit(&world);
    std::fs::write(folder.path().join("desk.toml"), edited).unwrap();
    std::fs::copy(data.join("board.toml"), folder.path().join("board.toml")).unwrap();
    let path = folder.path().display().to_string();
    let uri = format!("sim:{path}/desk.toml#camera?pace=fast&cache={path}/cache");
    let registry = sources::registry();
    let camera = registry.open(&uri).unwrap();
    let open = move || registry.open(&uri);
    (folder, Source { camera, open: Box::new(open) })
}

/// The numbers of the frames.
#[derive(Clone, Default)]
struct Stamps(Arc<Mutex<Vec<Timestamp>>>);

impl Track for Stamps {
    type Tracking = ();

    fn track(&mut self, image: &Luma<'_>, captured: Timestamp) {
        assert_eq!((image.width_px(), image.height_px()), (80, 60));
        self.0.lock().unwrap().push(captured);
    }
}

fn simulate(edit: impl Fn(&str) -> String) -> (Vec<u64>, Finished) {
    let (_folder, source) = simulated(edit);
    let mut pipeline = Pipeline::start(source, || Ok(Stamps::default()), EVERY).unwrap();
    let mut numbers = Vec::new();
    while let Ok(tracked) = pipeline.receive(HANG) {
        numbers.push(tracked.frame.sequence);
    }
    (numbers, pipeline.finish())
}

#[test]
fn the_faults_of_a_simulated_camera_are_those_reported() {
    // The world drops frame 3.
    let (numbers, finished) = simulate(str::to_owned);
    assert_eq!((numbers, finished.metrics.missing), (vec![0, 1, 2, 4], 1));
    assert!(finished.failures.is_empty(), "{:?}", finished.failures);

    let with = |fault: &str| {
        let line = format!("{{ kind = \"drop\", frames = [3] }},\n    {fault},");
        simulate(move |world| world.replacen("{ kind = \"drop\", frames = [3] },", &line, 1))
    };
    // Frame 2 is exposed at 0.2 s.
    let (numbers, finished) = with("{ kind = \"vanish\", at_s = 0.15 }");
    assert_eq!((numbers, finished.metrics.lost), (vec![0, 1], 1));
    assert!(format!("{:#}", finished.failures[0]).contains("vanished"), "{:?}", finished.failures);

    // 10 frames a second: a stall from half a second on.
    let (numbers, finished) = with("{ kind = \"stall\", from_s = 0.05, for_s = 0.9 }");
    assert_eq!((numbers, finished.metrics.stalls), (vec![0], 1), "{:?}", finished.events);
}
