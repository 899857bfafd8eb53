//! Makes the truth cases of `tests/truth`; `tests/truth/make` calls it for all of them.
//!
//! ```sh
//! cargo run -p coshade-tests --example truth -- trace tests/truth/2_bleeding   # the clean pictures, by our path tracer
//! cargo run -p coshade-tests --example truth -- sense tests/truth/2_bleeding   # what sensors make of them
//! ```

#![allow(clippy::print_stdout)]

mod sense;
mod trace;

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use coshade_tests::{PixelSet, TruthCase};

#[derive(Parser)]
struct Args {
    #[command(subcommand)]
    step: Step,
}

#[derive(Subcommand)]
enum Step {
    /// Trace world.toml: camera.exr, fisheye.exr, depth.png, truth.exr
    Trace { folder: PathBuf },
    /// From camera.exr, fisheye.exr and world.toml, make camera.png, fisheye.png, depth_sensor.png, sensor.toml
    Sense { folder: PathBuf },
}

fn main() -> anyhow::Result<()> {
    match Args::parse().step {
        Step::Trace { folder } => {
            trace::trace(&folder)?;
            let case = TruthCase::read(&folder)?;
            for set in PixelSet::ALL {
                let (naive, error) = (case.rmse(&case.real, set), case.standard_error(set));
                let share = error / naive;
                println!(
                    "{}: {set:?} {} px: change {naive:.5}, its standard error {error:.6} = {share:.4} of it",
                    folder.display(),
                    case.count(set)
                );
            }
        }
        Step::Sense { folder } => sense::sense(&folder)?,
    }
    Ok(())
}
