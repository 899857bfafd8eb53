//! The `coshade` command line.

mod canvas;
mod command;
mod interrupt;
mod pipeline;
mod sources;

use std::io::IsTerminal;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Mixed reality in which real and virtual things shade each other.
#[derive(Parser)]
#[command(name = "coshade", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Info(command::info::Args),
    Record(command::record::Args),
    Replay(command::replay::Args),
    Track(command::track::Args),
    Map(command::map::Args),
    Compare(command::compare::Args),
    Reference(command::reference::Args),
    Sheet(command::sheet::Args),
    Simulate(command::simulate::Args),
    Board(command::board::Args),
    Export(command::export::Args),
    Doctor(command::doctor::Args),
}

fn main() -> ExitCode {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("warn"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time()
        .init();
    let result = match Cli::parse().command {
        Command::Info(args) => command::info::run(&args),
        Command::Record(args) => command::record::run(&args),
        Command::Replay(args) => command::replay::run(&args),
        Command::Track(args) => command::track::run(&args),
        Command::Map(args) => command::map::run(&args),
        Command::Compare(args) => command::compare::run(&args),
        Command::Reference(args) => command::reference::run(&args),
        Command::Sheet(args) => command::sheet::run(&args),
        Command::Simulate(args) => command::simulate::run(&args),
        Command::Board(args) => command::board::run(&args),
        Command::Export(args) => command::export::run(&args),
        Command::Doctor(args) => command::doctor::run(&args),
    };
    match result {
        Ok(outcome) => outcome,
        Err(error) => {
            command::print::error(&error);
            ExitCode::from(2)
        }
    }
}
