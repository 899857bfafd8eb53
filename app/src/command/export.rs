//! `coshade export`: a session for other programs.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, bail};
use clap::ValueEnum;
use coshade_reference::mitsuba::MitsubaScene;
use coshade_scene::session::Session;
use serde::Serialize;

use super::{print, traced};

/// Write a session as a scene of another renderer.
///
/// The session's camera must stand still (`pose` in `[camera]`) and be a pinhole with fx = fy. Exact in Mitsuba: Lambert
/// (ior = 1), metal, smooth glass, area lights, the environment; the rest is approximated with a warning or refused with
/// its name. Render with `mitsuba -Dspp=256 scene.xml`.
#[derive(clap::Args)]
pub struct Args {
    /// Session file
    session: PathBuf,
    /// Mitsuba 3: the scene file to write, or a folder that gets a scene.xml; meshes and environment go beside it
    #[arg(long, value_name = "FOLDER_OR_XML")]
    mitsuba: PathBuf,
    /// real = without the virtual things and lights; mixed = with them
    #[arg(long, value_enum, default_value_t = WorldArg::Mixed)]
    world: WorldArg,
    /// Write nothing if anything would only be approximated
    #[arg(long)]
    exact: bool,
    /// Print one JSON object: `output` and `approximations`
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum WorldArg {
    Real,
    Mixed,
}

#[derive(Serialize)]
struct Summary<'a> {
    output: &'a Path,
    approximations: &'a [String],
}

/// Translates and writes.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let session = Session::read(&args.session)?;
    let place = || args.session.display().to_string();
    let things = traced::assembled(&session)?;
    let environment = traced::environment(&session)?;
    let camera = traced::camera(&session)?;
    let mixed = args.world == WorldArg::Mixed;
    let scene = MitsubaScene::new(&things, environment.as_ref(), &camera, mixed).with_context(place)?;
    let approximations = scene.approximations();
    if args.exact && !approximations.is_empty() {
        bail!("{}: not exact, so nothing was written: {}", place(), approximations.join("; "));
    }
    for approximation in approximations {
        tracing::warn!("{}: {approximation}", place());
    }
    let is_xml = args.mitsuba.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml"));
    let output = if is_xml { args.mitsuba.clone() } else { args.mitsuba.join("scene.xml") };
    scene.write(&output)?;
    if args.json {
        print::json(&Summary { output: &output, approximations })?;
    } else {
        print::text(&format!("{}\n", output.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
