//! `coshade map`: where tags are to each other, from images that each show some of them.

mod input;
mod report;
mod sight;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, anyhow, bail};
use coshade_lens::calibration::Calibration;
use coshade_tracker::map::{MapError, MapSettings, TagMap, View, map_tags};
use coshade_tracker::{BoardProvenance, Family, TagId};
use indicatif::{ProgressBar, ProgressStyle};

use super::print;
use super::track::{decimation, family, tag};
use crate::interrupt;
use input::Input;
use report::Summary;

/// Find out where tags are to each other: on the walls of a room, or on the sides of a thing.
///
/// Give images or a recording in which each tag is seen together with others, from several sides, so that all hang together;
/// walk around so that loops close. All tags and cameras are adjusted together to the pixels of all images, and
/// written as a board file, which `coshade track --board` and sessions take. Its frame is that of one tag: x right, y up
/// along the print, z out of the paper.
///
/// Prints a line for each tag: size, position in millimetres and rotation in degrees (about fixed x first, then y, then z)
/// with standard deviations, and how well it fits; then what does not fit, and by how much the largest loop of tags fails
/// to close if it is cut. If no size is known give any: all lengths grow with it, angles stay.
///
/// Exit code 1 if tags could not be connected to the others and are missing from the map; 2 if there is no map.
#[derive(clap::Args)]
pub struct Args {
    /// Session file (its camera); or a source, such as replay:room.mcap#camera or images:photos/*.jpg
    #[arg(value_name = "SESSION|SOURCE")]
    input: String,
    /// Calibration file of the source, unless it brings its own
    #[arg(long, value_name = "TOML")]
    calibration: Option<PathBuf>,
    /// Size of all tags that are not named by --tag: side of the square through the detected corners
    #[arg(long, value_name = "METRES", value_parser = size)]
    size_m: Option<f64>,
    /// A tag of known size, such as tag36h11:7:0.05 (repeat for more). Without --size-m the first one's is that of all
    #[arg(long, value_name = "FAMILY:ID:SIZE_M", value_parser = tag)]
    tag: Vec<(TagId, f64)>,
    /// Estimate the sizes of all tags not named by --tag, starting from --size-m, which may be off by a tenth or so
    #[arg(long)]
    free_sizes: bool,
    /// The tag whose frame is the map's, such as 7 or tagStandard41h12:7 [default: the lowest of the largest group]
    #[arg(long, value_name = "[FAMILY:]ID")]
    origin: Option<String>,
    /// A family to look for (repeat for more) [default: tag36h11, and those of --tag]
    #[arg(long, value_name = "NAME", value_parser = family)]
    family: Vec<Family>,
    /// Estimate the lens' parameters too (a pinhole's with the distortion of brown_conrady5); needs many views with tags out
    /// to the image's corners
    #[arg(long)]
    refine_lens: bool,
    /// Write the estimated lens as a calibration file
    #[arg(long, value_name = "TOML", requires = "refine_lens")]
    refined_calibration: Option<PathBuf>,
    /// Use every n-th image only
    #[arg(long, value_name = "COUNT", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// Look for tags in an image so many times smaller. Higher: faster, and small tags are missed
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = decimation)]
    decimate: f32,
    /// Threads of the detector
    #[arg(long, value_name = "COUNT", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=64))]
    threads: u32,
    /// The board file to write
    #[arg(short, long, value_name = "TOML")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    overwrite: bool,
    /// Print one JSON object: `input`, `output`, `origin`; `images`, `images_damaged`, `images_with_tags`;
    /// `images_used` (that show two tags and fit); `tags`: `family`, `id`, `size_m`, `size_std_m` (null unless estimated),
    /// `position_m`, `quaternion_xyzw`, `rotation_deg`, `position_std_mm`, `rotation_std_deg`, `covariance` (6×6, of a twist
    /// on the left: rotation in rad, translation in m), `views`, `rms_px`; `views`: `image`, `seen` (names of tags), `used`,
    /// `rms_px`, `camera_from_map` (null if the image is not used); `rejected`: `image`, `tag`, `rms_px` (null: outside the
    /// lens' field of view); `unconnected` (groups of tags); `rms_px`, `rms_mrad` (the same as an angle), `reduced_chi2`,
    /// `unexplained_px` (error of a corner's coordinates beside its own); `lens`: `model`, `params` and, if estimated,
    /// `params_std`; `closure` (null without a loop of four tags): `tags`, `images_across`, `images_around`, `length_m`,
    /// `adjusted` and `chained`, each `translation_mm` and `rotation_deg`; `warnings`
    #[arg(long, verbatim_doc_comment)]
    json: bool,
}

/// Looks, maps, writes.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    check_outputs(args)?;
    let settings = settings(args)?;
    let input = Input::open(&args.input, args.calibration.as_deref())?;
    let stop = interrupt::on_ctrl_c()?;
    let progress = progress(&args.input);
    let (name, calibration) = (input.name.clone(), input.calibration.clone());
    let sights = sight::look(input, args, &families(args, &settings), stop, &progress)?;
    progress.set_message("adjusting");
    let goes_on = || {
        progress.tick();
        !stop.load(Ordering::Relaxed)
    };
    let views = views(&sights.images, args.every);
    let map = map_tags(&views, &calibration.model, &settings, &goes_on);
    progress.finish_and_clear();
    let map = map.map_err(|error| told(error, &name, &sights))?;
    save(args, &name, &map, &calibration)?;
    let summary = Summary::new(args, &name, &sights, &map);
    for warning in &summary.warnings {
        tracing::warn!("{warning}");
    }
    if args.json {
        print::json(&summary)?;
    } else {
        print::text(&summary.text())?;
    }
    Ok(if map.unconnected.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn views(images: &[View], every: u64) -> Vec<View> {
    images.iter().filter(|view| view.number % every == 0).cloned().collect()
}

fn told(error: MapError, name: &str, sights: &sight::Sights) -> anyhow::Error {
    let tagged = sights.images.iter().filter(|view| !view.observations.is_empty()).count();
    let images = sights.images.len();
    anyhow!(error).context(format!("{name}: {images} images, {tagged} of them with tags"))
}

fn settings(args: &Args) -> anyhow::Result<MapSettings> {
    if args.size_m.is_none() && args.tag.is_empty() {
        bail!(
            "no tag's size is known: give --size-m 0.16, or --tag tag36h11:0:0.16 for one. If nobody has measured it any will \
             do: all lengths grow with it"
        );
    }
    if let Some((index, (tag, _))) = args
        .tag
        .iter()
        .enumerate()
        .find(|(index, (tag, _))| args.tag.iter().skip(index + 1).any(|(other, _)| other == tag))
    {
        bail!("--tag {tag}: is given twice (first as number {})", index + 1);
    }
    Ok(MapSettings {
        origin: args.origin.as_deref().map(|text| origin(text, args)).transpose()?,
        size_m: args.size_m,
        sizes_m: args.tag.clone(),
        free_sizes: args.free_sizes,
        refine_lens: args.refine_lens,
    })
}

fn origin(text: &str, args: &Args) -> anyhow::Result<TagId> {
    let (family, id) = match text.split_once(':') {
        Some((name, id)) => (family(name).map_err(|error| anyhow!("--origin {text}: {error}"))?, id),
        None => match args.family.as_slice() {
            [] => (Family::Tag36h11, text),
            [family] => (*family, text),
            _ => bail!("--origin {text}: of which family? Write it as tag36h11:{text}"),
        },
    };
    let id = id.parse().ok().filter(|id| *id < family.tag_count());
    let id =
        id.ok_or_else(|| anyhow!("--origin {text}: {family} has tags from 0 to {}", family.tag_count() - 1))?;
    Ok(TagId { family, id })
}

fn families(args: &Args, settings: &MapSettings) -> Vec<Family> {
    let named =
        settings.sizes_m.iter().map(|(tag, _)| tag.family).chain(settings.origin.map(|tag| tag.family));
    let mut families: Vec<Family> = named.chain(args.family.iter().copied()).collect();
    if families.is_empty() {
        families.push(Family::Tag36h11);
    }
    families.sort_unstable();
    families.dedup();
    families
}

/// Nothing is written where anything would be in the way.
fn check_outputs(args: &Args) -> anyhow::Result<()> {
    for path in [Some(&args.output), args.refined_calibration.as_ref()].into_iter().flatten() {
        let name = path.display();
        if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
            bail!("{name}: board and calibration files end in .toml");
        }
        if path.is_dir() {
            bail!("{name}: is a folder; name a file in it");
        }
        if path.exists() && !args.overwrite {
            bail!("{name}: exists already; choose another name, or give --overwrite");
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            bail!("{name}: there is no folder {}", folder.display());
        }
    }
    if args.refined_calibration.as_ref() == Some(&args.output) {
        bail!("{}: is written twice", args.output.display());
    }
    Ok(())
}

fn save(args: &Args, name: &str, map: &TagMap, calibration: &Calibration) -> anyhow::Result<()> {
    let tool = || Some(concat!("coshade map ", env!("CARGO_PKG_VERSION")).to_owned());
    let scale = match args.tag.is_empty() {
        true => "scale by --size-m",
        false => "scale by --tag",
    };
    let board = map.board(BoardProvenance {
        tool: tool(),
        images: vec![name.to_owned()],
        rms_px: Some(map.rms_px),
        notes: Some(format!("Frame of {}; {scale}; {} views.", map.origin, map.views.len())),
        ..BoardProvenance::default()
    });
    board.save(&args.output)?;
    let Some(file) = &args.refined_calibration else { return Ok(()) };
    let mut refined = Calibration { model: map.lens, ..calibration.clone() };
    refined.provenance.tool = tool();
    refined.provenance.rms_px = Some(map.rms_px);
    refined.provenance.covariance = None;
    let std = map.lens_std.iter().flatten().copied();
    refined.provenance.std_dev =
        map.lens.param_names().iter().map(|name| (*name).to_owned()).zip(std).collect();
    if file.exists() {
        std::fs::remove_file(file).with_context(|| format!("{}: cannot be replaced", file.display()))?;
    }
    Ok(refined.write(file)?)
}

fn progress(input: &str) -> ProgressBar {
    let progress = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("mapping {elapsed} {prefix}: {pos} images {msg}") {
        progress.set_style(style);
    }
    progress.set_prefix(input.to_owned());
    progress
}

fn size(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(size_m) if (1e-6..=100.0).contains(&size_m) => Ok(size_m),
        _ => Err("metres, from 1e-6 to 100, such as 0.16".to_owned()),
    }
}

/// Whether to end what is going on.
fn stopped(stop: &AtomicBool) -> bool {
    stop.load(Ordering::Relaxed)
}
