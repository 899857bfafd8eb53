//! What is in a folder of images: layout, streams, depth range, and what is wrong with it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::files;
use super::read::{Probe, Reader, Target, probe};
use super::tum;
use crate::frame::Frame;
use crate::pixel_format::PixelFormat;

/// Depth images of a series that are read for its statistics, spread evenly.
const SAMPLED_DEPTH_FRAMES: usize = 24;
/// Problems of one kind that are listed one by one.
const LISTED_PROBLEMS: usize = 5;

/// How the files of a folder belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FolderLayout {
    /// `rgb.txt` and `depth.txt` list files and times (TUM RGB-D benchmark).
    Tum,
    /// `frame-000000.color.*`, `.depth.png`, `.pose.txt` (7-Scenes, BundleFusion, Open3D recordings).
    SevenScenes,
    /// Series of colour images beside series of depth images.
    ColorAndDepth,
    /// Images only.
    Images,
}

/// What [`describe`] found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Description {
    /// The folder described.
    #[serde(serialize_with = "crate::lossy_path")]
    pub folder: PathBuf,
    /// How its files belong together.
    pub layout: FolderLayout,
    /// The streams in it.
    pub series: Vec<Series>,
    /// Camera poses that lie beside the images.
    pub poses: usize,
    /// What a user should know before using the folder, in sentences.
    pub problems: Vec<String>,
}

/// Images that make a stream.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// The source to open for this stream.
    pub uri: String,
    /// Number of files.
    pub frames: usize,
    /// Width of the first readable image in pixels.
    pub width_px: u32,
    /// Height of the first readable image in pixels.
    pub height_px: u32,
    /// Format of the frames the source gives.
    pub format: PixelFormat,
    /// Depth statistics, `None` for images.
    pub depth: Option<DepthSummary>,
    /// Smallest and largest value of 16 bit grey images as they are in the files, of the images read.
    pub codes: Option<[u16; 2]>,
}

/// Where a depth unit comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum UnitSource {
    /// The caller gave it.
    Given,
    /// The layout defines it.
    Layout,
    /// Nothing says; millimetres are usual.
    Assumed,
}

/// What depth images hold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DepthSummary {
    /// Metres a count.
    pub unit_m: f64,
    /// Where the unit comes from.
    pub unit_source: UnitSource,
    /// Images read for these figures.
    pub frames_read: usize,
    /// Share of pixels with a measurement, 0 to 1.
    pub valid_share: f64,
    /// Nearest depth in metres; `None` if nothing is valid.
    pub min_m: Option<f64>,
    /// Median depth in metres.
    pub median_m: Option<f64>,
    /// Farthest depth in metres.
    pub max_m: Option<f64>,
}

/// Why a folder cannot be described.
#[derive(Debug, thiserror::Error)]
pub enum DescribeError {
    /// It is no folder or cannot be read.
    #[error("{}: {error}", folder.display())]
    Unreadable {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// There is nothing to describe.
    #[error("{}: no images (PNG, JPEG, PGM, PPM, EXR, HDR) here or one folder below", folder.display())]
    NoImages {
        /// The folder.
        folder: PathBuf,
    },
    /// A list of a TUM folder is wrong.
    #[error(transparent)]
    Tum(#[from] tum::TumError),
}

/// Looks at the images of a folder and of the folders in it.
///
/// 16 bit grey images are taken for depth where the layout or their name says so, or if `depth_unit_m` is given.
///
/// # Errors
/// [`DescribeError`]; single unreadable files are problems of the description, no errors.
pub fn describe(folder: &Path, depth_unit_m: Option<f64>) -> Result<Description, DescribeError> {
    if folder.join("rgb.txt").is_file() && folder.join("depth.txt").is_file() {
        return describe_tum(folder, depth_unit_m);
    }
    let unreadable = |error| DescribeError::Unreadable { folder: folder.into(), error };
    let groups = grouped(all_images(folder).map_err(unreadable)?);
    if groups.is_empty() {
        return Err(DescribeError::NoImages { folder: folder.into() });
    }
    let mut problems = Vec::new();
    let is_seven_scenes = is_seven_scenes(&groups);
    let mut series = Vec::new();
    for (pattern, files) in &groups {
        let unit = match (depth_unit_m, is_seven_scenes && pattern.contains(".depth.")) {
            (Some(unit_m), _) => (unit_m, UnitSource::Given),
            (None, true) => (0.001, UnitSource::Layout),
            (None, false) => (0.001, UnitSource::Assumed),
        };
        let is_named_depth = files.iter().any(|file| is_named_depth(folder, file));
        let may_be_depth = depth_unit_m.is_some() || is_named_depth;
        series.extend(describe_series(pattern, files, may_be_depth.then_some(unit), &mut problems));
    }
    let has_depth = series.iter().any(|series| series.depth.is_some());
    let has_images = series.iter().any(|series| series.depth.is_none());
    let layout = match () {
        () if is_seven_scenes => FolderLayout::SevenScenes,
        () if has_depth && has_images => FolderLayout::ColorAndDepth,
        () => FolderLayout::Images,
    };
    if has_depth && has_images {
        compare_counts(&series, &mut problems);
    }
    let poses = count_poses(folder);
    if is_seven_scenes && poses > 0 && series.iter().any(|series| series.frames != poses) {
        problems.push(format!("{poses} pose files, which is not the number of frames"));
    }
    Ok(Description { folder: folder.into(), layout, series, poses, problems })
}

/// Looks at a single image; as [`describe`] does for a folder with nothing else in it.
pub fn describe_file(file: &Path, depth_unit_m: Option<f64>) -> Description {
    let mut problems = Vec::new();
    let unit = match depth_unit_m {
        Some(unit_m) => Some((unit_m, UnitSource::Given)),
        None => file
            .file_name()
            .is_some_and(|name| name.to_string_lossy().to_ascii_lowercase().contains("depth"))
            .then_some((0.001, UnitSource::Assumed)),
    };
    let pattern = file.to_string_lossy();
    let series = describe_series(&pattern, &[file.to_owned()], unit, &mut problems);
    let folder = file.parent().unwrap_or(Path::new("")).to_owned();
    Description {
        folder,
        layout: FolderLayout::Images,
        series: series.into_iter().collect(),
        poses: 0,
        problems,
    }
}

fn describe_tum(folder: &Path, depth_unit_m: Option<f64>) -> Result<Description, DescribeError> {
    let color = tum::read_files(&folder.join("rgb.txt"))?;
    let depth = tum::read_files(&folder.join("depth.txt"))?;
    let mut problems = Vec::new();
    let source = |stream: &str| format!("images:{}?layout=tum&stream={stream}", folder.display());
    let unit = match depth_unit_m {
        Some(unit_m) => (unit_m, UnitSource::Given),
        None => (tum::DEPTH_UNIT_M, UnitSource::Layout),
    };
    let mut series = Vec::new();
    for (stream, files, unit) in [("rgb", &color, None), ("depth", &depth, Some(unit))] {
        let paths: Vec<PathBuf> = files.iter().map(|file| file.path.clone()).collect();
        if let Some(mut found) = describe_series("", &paths, unit, &mut problems) {
            found.uri = match depth_unit_m.filter(|_| stream == "depth") {
                Some(unit_m) => format!("{}&depth_unit_m={unit_m}", source(stream)),
                None => source(stream),
            };
            series.push(found);
        }
    }
    let stamps = |files: &[tum::TumFile]| files.iter().map(|file| file.stamp).collect::<Vec<_>>();
    let within = std::time::Duration::from_millis(20);
    let pairs = tum::associate(&stamps(&color), &stamps(&depth), within).len();
    if pairs < color.len().min(depth.len()) {
        problems.push(format!(
            "{pairs} of {} colour and {} depth images are within 20 ms of each other: add associate_s=0.02",
            color.len(),
            depth.len()
        ));
    }
    let truth = folder.join("groundtruth.txt");
    let poses = if truth.is_file() { tum::read_poses(&truth)?.len() } else { 0 };
    Ok(Description { folder: folder.into(), layout: FolderLayout::Tum, series, poses, problems })
}

/// The images of the folder and of the folders in it, in natural order.
fn all_images(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut images = files::images_in(folder)?;
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            images.extend(files::images_in(&path)?);
        }
    }
    files::sort(&mut images);
    Ok(images)
}

/// Files whose names differ in numbers only, by the glob pattern that finds them; in natural order.
fn grouped(images: Vec<PathBuf>) -> BTreeMap<String, Vec<PathBuf>> {
    let mut groups: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for path in images {
        let folder = glob::Pattern::escape(&path.parent().unwrap_or(Path::new("")).to_string_lossy());
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let pattern = Path::new(&folder).join(numbers_to_stars(&name));
        groups.entry(pattern.to_string_lossy().into_owned()).or_default().push(path);
    }
    // A pattern for a single file would say less than its name.
    groups
        .into_iter()
        .map(|(pattern, files)| match files.as_slice() {
            [single] => (single.to_string_lossy().into_owned(), files),
            _ => (pattern, files),
        })
        .collect()
}

fn numbers_to_stars(name: &str) -> String {
    let mut pattern = String::new();
    for part in name.split_inclusive(|c: char| c.is_ascii_digit()) {
        let text = part.trim_end_matches(|c: char| c.is_ascii_digit());
        pattern.push_str(&glob::Pattern::escape(text));
        if text.len() < part.len() && !pattern.ends_with('*') {
            pattern.push('*');
        }
    }
    pattern
}

fn is_seven_scenes(groups: &BTreeMap<String, Vec<PathBuf>>) -> bool {
    let has = |kind: &str| {
        groups.keys().any(|pattern| file_name(pattern).starts_with("frame-") && pattern.contains(kind))
    };
    has(".color.") && has(".depth.")
}

/// Whether a file or the folder it is in, inside `folder`, is called depth.
fn is_named_depth(folder: &Path, file: &Path) -> bool {
    let inside = file.strip_prefix(folder).unwrap_or(file);
    inside.to_string_lossy().to_ascii_lowercase().contains("depth")
}

fn file_name(pattern: &str) -> &str {
    pattern.rsplit(['/', '\\']).next().unwrap_or(pattern)
}

fn describe_series(
    pattern: &str,
    files: &[PathBuf],
    unit: Option<(f64, UnitSource)>,
    problems: &mut Vec<String>,
) -> Option<Series> {
    let probe = common_probe(files, problems)?;
    let mut statistics = (probe.format == PixelFormat::Y16).then(|| Statistics::of(files));
    if let Some(statistics) = &mut statistics {
        problems.append(&mut statistics.problems);
    }
    let depth = unit.zip(statistics.as_ref()).map(|((unit_m, unit_source), statistics)| {
        let summary = statistics.summary(unit_m, unit_source);
        check_depth(pattern, &summary, statistics, problems);
        summary
    });
    let codes = statistics.and_then(|statistics| statistics.range());
    let uri = match &depth {
        Some(depth) => format!("images:{pattern}?depth_unit_m={}", depth.unit_m),
        None => format!("images:{pattern}"),
    };
    let format = if depth.is_some() { PixelFormat::Z16 } else { probe.format };
    let Probe { width_px, height_px, .. } = probe;
    Some(Series { uri, frames: files.len(), width_px, height_px, format, depth, codes })
}

/// Format and size of the first readable file; the others must have the same.
fn common_probe(files: &[PathBuf], problems: &mut Vec<String>) -> Option<Probe> {
    let mut first: Option<Probe> = None;
    let mut found = Vec::new();
    for path in files {
        match (probe(path, None), first) {
            (Err(reason), _) => found.push(format!("{}: {reason}", path.display())),
            (Ok(probed), None) => first = Some(probed),
            (Ok(probed), Some(expected)) if probed != expected => found.push(format!(
                "{}: {} of {} x {} pixels, the first of its series is {} of {} x {}",
                path.display(),
                probed.format,
                probed.width_px,
                probed.height_px,
                expected.format,
                expected.width_px,
                expected.height_px
            )),
            _ => {}
        }
    }
    shorten(&mut found);
    problems.append(&mut found);
    first
}

fn shorten(problems: &mut Vec<String>) {
    let more = problems.len().saturating_sub(LISTED_PROBLEMS);
    if more > 0 {
        problems.truncate(LISTED_PROBLEMS);
        problems.push(format!("… and {more} more files of that kind"));
    }
}

/// How often each depth code occurs in some images of a series.
struct Statistics {
    counts: Vec<u64>,
    frames_read: usize,
    problems: Vec<String>,
}

impl Statistics {
    fn of(files: &[PathBuf]) -> Self {
        let mut counts = vec![0_u64; 1 << 16];
        let (mut frames_read, mut problems) = (0, Vec::new());
        // Counts as they are: the unit comes in later.
        let mut reader = Reader::new(Target::Depth { unit_m: 1.0, invalid: None }, None);
        let wanted = files.len().min(SAMPLED_DEPTH_FRAMES);
        for path in (0..wanted).filter_map(|n| files.get(n * files.len() / wanted)) {
            match reader.read(path) {
                Ok(frame) => {
                    count_codes(&frame, &mut counts);
                    frames_read += 1;
                }
                Err(reason) => problems.push(format!("{}: {reason}", path.display())),
            }
        }
        shorten(&mut problems);
        Self { counts, frames_read, problems }
    }

    fn valid(&self) -> u64 {
        self.counts.iter().skip(1).sum()
    }

    fn share(&self, count: u64) -> f64 {
        count as f64 / (self.counts.iter().sum::<u64>() as f64).max(1.0)
    }

    fn saturated_share(&self) -> f64 {
        self.share(self.counts.last().copied().unwrap_or(0))
    }

    /// Smallest and largest code, 0 included.
    fn range(&self) -> Option<[u16; 2]> {
        let min = self.counts.iter().position(|count| *count > 0)?;
        let max = self.counts.iter().rposition(|count| *count > 0)?;
        Some([u16::try_from(min).ok()?, u16::try_from(max).ok()?])
    }

    /// The code below which half of the valid pixels lie.
    fn median(&self) -> Option<usize> {
        let half = self.valid().div_ceil(2);
        let mut below = 0;
        self.counts.iter().enumerate().skip(1).find_map(|(code, count)| {
            below += count;
            (*count > 0 && below >= half).then_some(code)
        })
    }

    fn summary(&self, unit_m: f64, unit_source: UnitSource) -> DepthSummary {
        let metres = |code: usize| code as f64 * unit_m;
        DepthSummary {
            unit_m,
            unit_source,
            frames_read: self.frames_read,
            valid_share: self.share(self.valid()),
            min_m: self.counts.iter().skip(1).position(|count| *count > 0).map(|code| metres(code + 1)),
            median_m: self.median().map(metres),
            max_m: self.counts.iter().rposition(|count| *count > 0).filter(|code| *code > 0).map(metres),
        }
    }
}

fn count_codes(frame: &Frame, counts: &mut [u64]) {
    for code in frame.pixels.as_chunks::<2>().0 {
        if let Some(count) = counts.get_mut(usize::from(u16::from_le_bytes(*code))) {
            *count += 1;
        }
    }
}

fn check_depth(pattern: &str, summary: &DepthSummary, statistics: &Statistics, problems: &mut Vec<String>) {
    let DepthSummary { unit_m, median_m, .. } = *summary;
    let name = if pattern.is_empty() { "depth" } else { file_name(pattern) };
    match median_m {
        None if summary.frames_read > 0 => problems.push(format!("{name}: no pixel holds a depth")),
        // A room or a desk is between these.
        Some(median_m) if !(0.1..=8.0).contains(&median_m) => problems.push(format!(
            "{name}: with a unit of {unit_m} m the median depth is {median_m:.2} m: is the unit another, such as {}?",
            if median_m > 8.0 { "0.0002 (TUM) or 0.0001" } else { "0.001" }
        )),
        _ => {}
    }
    let saturated = statistics.saturated_share();
    if saturated > 0.001 {
        problems.push(format!(
            "{name}: {:.1} % of the pixels hold 65535, which often means no measurement: add depth_invalid=65535",
            saturated * 100.0
        ));
    }
}

fn compare_counts(series: &[Series], problems: &mut Vec<String>) {
    let frames = |depth: bool| -> usize {
        series.iter().filter(|series| series.depth.is_some() == depth).map(|series| series.frames).sum()
    };
    let (images, depths) = (frames(false), frames(true));
    if images != depths {
        problems.push(format!("{images} images but {depths} depth images: they are not pairs"));
    }
}

/// `*.pose.txt` files, or the poses in `pose.txt`, `poses.txt` or `groundtruth.txt`.
fn count_poses(folder: &Path) -> usize {
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let single = names.filter(|entry| entry.file_name().to_string_lossy().ends_with(".pose.txt")).count();
    if single > 0 {
        return single;
    }
    let list = ["pose.txt", "poses.txt", "groundtruth.txt"].iter().find_map(|name| {
        let text = std::fs::read_to_string(folder.join(name)).ok()?;
        Some(text.lines().filter(|line| is_pose(line)).count())
    });
    list.unwrap_or(0)
}

/// Position and quaternion, maybe behind a time; files of these names also hold other things.
fn is_pose(line: &str) -> bool {
    let values: Option<Vec<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
    values.is_some_and(|values| matches!(values.len(), 7 | 8))
}

impl Series {
    /// One line for people, without the source.
    pub fn line(&self) -> String {
        let Self { frames, width_px, height_px, format, depth, codes, .. } = self;
        let content = match (depth, codes) {
            (Some(depth), _) => depth.line(),
            (None, Some([min, max])) => format!(", values {min} to {max}"),
            (None, None) => String::new(),
        };
        format!("{frames} x {format} {width_px} x {height_px} px{content}")
    }
}

impl DepthSummary {
    fn line(&self) -> String {
        let unit_source = match self.unit_source {
            UnitSource::Given => "given",
            UnitSource::Layout => "by the layout",
            UnitSource::Assumed => "assumed",
        };
        let range = match (self.min_m, self.median_m, self.max_m) {
            (Some(min), Some(median), Some(max)) => format!("{min:.3} to {max:.3} m, median {median:.3} m"),
            _ => "no depth".into(),
        };
        format!(
            ", {range}, {:.1} % valid, unit {} m ({unit_source}), {} read",
            self.valid_share * 100.0,
            self.unit_m,
            self.frames_read
        )
    }
}

impl FolderLayout {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tum => "TUM RGB-D",
            Self::SevenScenes => "7-Scenes",
            Self::ColorAndDepth => "colour and depth images",
            Self::Images => "images",
        }
    }
}

impl std::fmt::Display for Description {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}: {}, {} poses", self.folder.display(), self.layout.name(), self.poses)?;
        for series in &self.series {
            writeln!(f, "  {}  {}", series.line(), series.uri)?;
        }
        for problem in &self.problems {
            writeln!(f, "  problem: {problem}")?;
        }
        Ok(())
    }
}
