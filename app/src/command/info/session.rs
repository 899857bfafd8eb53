//! Session files.

use std::fmt::Write as _;
use std::path::Path;

use coshade_config::Problem as FileProblem;
use coshade_scene::World;
use coshade_scene::session::sensors::Mount;
use coshade_scene::session::{Session, SessionSpec};
use serde_json::json;

use super::{Found, Problem, Severity};
use crate::sources;

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let session = match Session::read(path) {
        Ok(session) => session,
        Err(error) if !error.problems().is_empty() => return Ok(refused(error.problems())),
        Err(error) => return Err(error.into()),
    };
    let files = session.check();
    let mut problems: Vec<_> = files.iter().map(problem).collect();
    problems.extend(unopenable(&session)?);
    if !files.iter().any(FileProblem::is_error) {
        problems.extend(unfit_images(&session)?);
    }
    Ok(Found { content: serde_json::to_value(session.spec())?, text: text(session.spec()), problems })
}

/// A file that cannot be used still has a list of what is wrong with it.
fn refused(problems: &[FileProblem]) -> Found {
    let problems = problems.iter().map(problem).collect();
    Found { content: json!(null), text: String::new(), problems }
}

fn problem(problem: &FileProblem) -> Problem {
    let severity = if problem.is_error() { Severity::Error } else { Severity::Warning };
    // The severity stands before the message already.
    Problem::new(severity, problem.to_string().replacen(&format!(" {}:", problem.severity), "", 1))
}

/// Sources whose kind this program does not have.
fn unopenable(session: &Session) -> anyhow::Result<Vec<Problem>> {
    let registry = sources::registry();
    let known: Vec<_> = registry.schemes().map(|(name, _)| name).collect();
    let sensors = sources::sensors(session)?;
    let unknown = sensors
        .iter()
        .filter(|sensor| !known.iter().any(|name| sensor.source.starts_with(&format!("{name}:"))));
    Ok(unknown
        .map(|sensor| {
            let message = format!("[{}]: this program opens only {} sources", sensor.name, known.join(", "));
            Problem::new(Severity::Error, message)
        })
        .collect())
}

/// Images whose headers already show that they, or their calibrations, cannot be used.
fn unfit_images(session: &Session) -> anyhow::Result<Vec<Problem>> {
    let registry = sources::registry();
    let sensors = sources::sensors(session)?;
    let images = sensors.iter().filter(|sensor| sensor.source.starts_with("images:"));
    let problem = |sensor: &sources::Sensor| {
        let opened = registry.open(&sensor.source).map_err(anyhow::Error::from);
        let checked = opened.and_then(|camera| match &sensor.calibration {
            Some(file) => sources::calibration_for(camera.as_ref(), file).map(drop),
            None => Ok(()),
        });
        let error = checked.err()?;
        Some(Problem::new(Severity::Error, format!("[{}]: {error:#}", sensor.name)))
    };
    Ok(images.filter_map(problem).collect())
}

fn text(spec: &SessionSpec) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "  camera: {}", spec.camera.source);
    if let Some(fisheye) = &spec.fisheye {
        let mount = match fisheye.mount {
            Mount::Rig => "on the rig",
            Mount::World => "fixed in the world",
        };
        let _ = writeln!(out, "  fisheye: {}, {mount}", fisheye.source);
    }
    if let Some(environment) = &spec.environment {
        let _ = writeln!(out, "  environment: {}", environment.file.display());
    }
    if let Some(depth) = &spec.depth {
        let _ = writeln!(out, "  depth: {}", depth.source);
    }
    for thing in &spec.things {
        let _ = writeln!(out, "  {} thing {}", world(thing.world), thing.name);
    }
    for (index, light) in spec.lights.iter().enumerate() {
        let name = light.name.clone().unwrap_or_else(|| index.to_string());
        let _ = writeln!(out, "  {} light {name}", world(light.world));
    }
    out
}

fn world(world: World) -> &'static str {
    match world {
        World::Real => "real",
        World::Virtual => "virtual",
    }
}
