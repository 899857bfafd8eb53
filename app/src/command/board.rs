//! `coshade board`: prints tags, and writes where they are on the print.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, bail};
use coshade_tracker::Family;
use coshade_tracker::print::{Paper, PrintSpec, Sheet};
use serde::Serialize;

use super::print;

/// Inches of resolutions.
const INCH_M: f64 = 0.0254;

/// Print AprilTags true to scale, one or a board of them, and write the board file that goes with the print.
///
/// Sizes and gaps are of the squares between detected corners (tag36h11: the outer edge of the black square). Each tag keeps
/// a white ring of one cell, without which detectors miss it. A ruler shows whether the printer kept the scale, an arrow which way
/// is up. PNG holds whole pixels, so with one among the outputs the sizes of all of them are rounded to its pixels; the
/// board file states the sizes as printed.
#[derive(clap::Args)]
pub struct Args {
    /// Family of the tags, such as tag36h11 or tagStandard41h12
    #[arg(long, default_value = "tag36h11")]
    family: Family,
    /// A single tag: its number
    #[arg(long, value_name = "ID", conflicts_with_all = ["ids", "grid", "first_id", "gap_mm"])]
    id: Option<u32>,
    /// Numbers of the tags, such as 3,7,9 or 0-11; in one row unless --grid is given
    #[arg(long, value_name = "ID,ID-ID,…", value_parser = id_list)]
    ids: Option<IdList>,
    /// Columns and rows of a board, such as 4x3; numbered row by row from the upper left
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = grid)]
    grid: Option<[u32; 2]>,
    /// Number of the first tag of a grid [default: 0]
    #[arg(long, value_name = "ID", requires = "grid", conflicts_with = "ids")]
    first_id: Option<u32>,
    /// Size of a tag
    #[arg(long)]
    size_mm: f64,
    /// Between the squares of neighbours [default: the least that leaves each its white ring]
    #[arg(long)]
    gap_mm: Option<f64>,
    /// a0 to a5, letter, legal, tabloid, WIDTHxHEIGHT in millimetres, or fit: as large as the board
    #[arg(long, default_value = "a4")]
    paper: Paper,
    /// Turn the paper's longer side level
    #[arg(long)]
    landscape: bool,
    /// Border of the paper that the printer leaves white
    #[arg(long, value_name = "MM", default_value_t = 5.0)]
    margin_mm: f64,
    /// Leave out the numbers under the tags. They are left out too where they would touch white rings
    #[arg(long)]
    no_labels: bool,
    /// Pixels per inch of PNG files, 25 to 10000
    #[arg(long, default_value_t = 600.0)]
    dpi: f64,
    /// A file to write: .pdf, .svg or .png (repeat for more)
    #[arg(short, long, required = true, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// The board file to write [default: as the first output, ending in .toml]
    #[arg(long, value_name = "FILE")]
    toml: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    overwrite: bool,
    /// Print one JSON object: `family`, `ids`, `columns`, `rows`; as printed, `size_mm`, `gap_mm`, `pitch_mm`, `paper_mm`,
    /// `first_corner_mm` (upper left corner of the first tag's square, right and down from the paper's), `has_labels`,
    /// `ruler_mm`, `upright_ruler_mm`, `px_per_m` (of PNG files); `notes`; `toml`; `outputs`
    #[arg(long)]
    json: bool,
}

/// Numbers of tags, in the order given.
#[derive(Clone, Debug, PartialEq)]
struct IdList(Vec<u32>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Pdf,
    Svg,
    Png,
}

#[derive(Serialize)]
struct Summary<'a> {
    family: &'a str,
    ids: &'a [u32],
    columns: usize,
    rows: usize,
    size_mm: f64,
    gap_mm: f64,
    pitch_mm: f64,
    paper_mm: [f64; 2],
    first_corner_mm: [f64; 2],
    has_labels: bool,
    ruler_mm: f64,
    upright_ruler_mm: Option<f64>,
    px_per_m: Option<u32>,
    notes: Vec<String>,
    toml: &'a Path,
    outputs: &'a [PathBuf],
}

/// Lays out, draws and writes.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let formats: Vec<Format> = args.output.iter().map(|path| format_of(path)).collect::<Result<_, _>>()?;
    let toml = match &args.toml {
        Some(toml) => toml.clone(),
        None => args.output.first().context("no output")?.with_extension("toml"),
    };
    check_files(args, &toml)?;
    let spec = spec(args, formats.contains(&Format::Png))?;
    let sheet = Sheet::new(&spec)?;
    let files: Vec<Vec<u8>> =
        formats.iter().map(|format| bytes(&sheet, &spec, *format)).collect::<Result<_, _>>()?;
    sheet.board.save(&toml)?;
    for (path, bytes) in args.output.iter().zip(files) {
        std::fs::write(path, bytes).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    report(args, &spec, &sheet, &toml)?;
    Ok(ExitCode::SUCCESS)
}

fn spec(args: &Args, with_png: bool) -> anyhow::Result<PrintSpec> {
    let (ids, columns) = tags(args)?;
    if !(25.0..=10_000.0).contains(&args.dpi) {
        bail!("--dpi {}: allowed are 25 to 10000", args.dpi);
    }
    Ok(PrintSpec {
        family: args.family,
        ids,
        columns,
        size_mm: args.size_mm,
        gap_mm: args.gap_mm,
        paper: if args.landscape { args.paper.clone().landscape() } else { args.paper.clone() },
        margin_mm: args.margin_mm,
        labels: !args.no_labels,
        // PNG files state whole pixels per metre.
        px_per_m: with_png.then(|| (args.dpi / INCH_M).round() as u32),
    })
}

/// The tags, and how many are in a row.
fn tags(args: &Args) -> anyhow::Result<(Vec<u32>, usize)> {
    match (args.id, &args.ids, args.grid) {
        (Some(id), ..) => Ok((vec![id], 1)),
        (None, None, None) => bail!("say which tags: --id 7, --ids 3,7,9, or --grid 4x3"),
        (None, Some(IdList(ids)), None) => Ok((ids.clone(), ids.len())),
        (None, Some(IdList(ids)), Some([columns, rows])) => {
            if ids.len() as u64 != u64::from(columns) * u64::from(rows) {
                bail!("--ids names {} tags, but --grid {columns}x{rows} holds {}", ids.len(), columns * rows);
            }
            Ok((ids.clone(), columns as usize))
        }
        (None, None, Some([columns, rows])) => {
            let first = args.first_id.unwrap_or(0);
            let Some(end) = first.checked_add(columns * rows).filter(|end| *end <= args.family.tag_count())
            else {
                bail!(
                    "{columns}x{rows} tags from {first} on are more than {} has: its last is {}",
                    args.family,
                    args.family.tag_count() - 1
                );
            };
            Ok(((first..end).collect(), columns as usize))
        }
    }
}

/// Nothing is written where anything would be in the way.
fn check_files(args: &Args, toml: &Path) -> anyhow::Result<()> {
    if !toml.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        bail!("{}: board files end in .toml", toml.display());
    }
    let mut seen: Vec<&Path> = Vec::new();
    for path in args.output.iter().map(PathBuf::as_path).chain([toml]) {
        if seen.contains(&path) {
            bail!("{}: is written twice", path.display());
        }
        seen.push(path);
        if path.is_dir() {
            bail!("{}: is a folder; name a file in it", path.display());
        }
        if path.exists() && !args.overwrite {
            bail!("{}: exists already; choose another name, or give --overwrite", path.display());
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            bail!("{}: there is no folder {}", path.display(), folder.display());
        }
    }
    Ok(())
}

fn format_of(path: &Path) -> anyhow::Result<Format> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match ending.as_str() {
        "pdf" => Ok(Format::Pdf),
        "svg" => Ok(Format::Svg),
        "png" => Ok(Format::Png),
        _ => bail!("{}: boards are written as .pdf, .svg or .png", path.display()),
    }
}

fn bytes(sheet: &Sheet, spec: &PrintSpec, format: Format) -> anyhow::Result<Vec<u8>> {
    Ok(match format {
        Format::Pdf => sheet.drawing.to_pdf(),
        Format::Svg => sheet.drawing.to_svg().into_bytes(),
        Format::Png => sheet.drawing.to_png(spec.px_per_m.context("no resolution")?)?,
    })
}

/// What the user should know beyond what was asked for.
fn notes(args: &Args, sheet: &Sheet) -> Vec<String> {
    let grid = &sheet.grid;
    let mut notes = Vec::new();
    let rounded = |asked: f64, printed: f64| (asked - printed).abs() > 1e-6;
    if rounded(args.size_mm, grid.size_mm) {
        notes.push(format!(
            "tags are {:.4} mm instead of {} mm, whole pixels at {} dpi",
            grid.size_mm, args.size_mm, args.dpi
        ));
    }
    if let Some(gap_mm) = args.gap_mm.filter(|gap_mm| rounded(*gap_mm, grid.gap_mm())) {
        notes.push(format!("gaps are {:.4} mm instead of {gap_mm} mm, whole pixels", grid.gap_mm()));
    }
    if !sheet.has_labels && !args.no_labels {
        notes.push("no numbers under the tags: between the white rings of two rows is no room".to_owned());
    }
    if sheet.upright_ruler_mm.is_none() {
        notes.push("no upright ruler: beside and under the board is no room".to_owned());
    }
    notes
}

fn report(args: &Args, spec: &PrintSpec, sheet: &Sheet, toml: &Path) -> anyhow::Result<()> {
    let grid = &sheet.grid;
    let summary = Summary {
        family: spec.family.name(),
        ids: &spec.ids,
        columns: grid.columns,
        rows: grid.rows,
        size_mm: grid.size_mm,
        gap_mm: grid.gap_mm(),
        pitch_mm: grid.pitch_mm,
        paper_mm: sheet.drawing.size_mm,
        first_corner_mm: sheet.first_square_mm,
        has_labels: sheet.has_labels,
        ruler_mm: sheet.ruler_mm,
        upright_ruler_mm: sheet.upright_ruler_mm,
        px_per_m: spec.px_per_m,
        notes: notes(args, sheet),
        toml,
        outputs: &args.output,
    };
    if args.json {
        return print::json(&summary);
    }
    let [width, height] = summary.paper_mm;
    let count = spec.ids.len();
    let (tags, gap) = match count {
        1 => ("tag", String::new()),
        _ => ("tags", format!(", gap {:.4} mm", summary.gap_mm)),
    };
    let mut text = format!(
        "{count} {tags} of {}, {:.4} mm{gap}, on {width} × {height} mm\n",
        spec.family, summary.size_mm
    );
    for note in &summary.notes {
        text += &format!("  note: {note}\n");
    }
    for path in args.output.iter().map(PathBuf::as_path).chain([toml]) {
        text += &format!("  {}\n", path.display());
    }
    print::text(&text)
}

/// `3,7,9` or `0-11`.
fn id_list(text: &str) -> Result<IdList, String> {
    let wrong = || "numbers and ranges with commas between, such as 3,7,9 or 0-11".to_owned();
    let mut ids = Vec::new();
    for part in text.split(',') {
        let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
        let (first, last) = match part.split_once('-') {
            Some((first, last)) => (number(first)?, number(last)?),
            None => (number(part)?, number(part)?),
        };
        if last < first || last - first >= 4096 || ids.len() >= 4096 {
            return Err(format!(
                "{}: at most 4096 tags, ranges from the lower number to the higher",
                part.trim()
            ));
        }
        ids.extend(first..=last);
    }
    Ok(IdList(ids))
}

/// `4x3`.
fn grid(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.trim().parse::<u32>().ok().filter(|side| (1..=64).contains(side));
    let parsed = text.split_once(['x', '×']).and_then(|(columns, rows)| Some([side(columns)?, side(rows)?]));
    parsed.ok_or_else(|| "COLUMNSxROWS, 1 to 64 each, such as 4x3".to_owned())
}
