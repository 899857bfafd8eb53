//! Compares two images: `compare A B [COVERAGE] [--diff OUT.png] [--flip OUT.png]`, and prints JSON.
#![allow(clippy::print_stdout, reason = "the report is the output")]

use std::error::Error;

use coshade_reference::compare::{CompareArgs, run};

fn main() -> Result<(), Box<dyn Error>> {
    let mut files = Vec::new();
    let (mut diff, mut flip) = (None, None);
    let mut words = std::env::args().skip(1).filter(|word| word != "compare" && word != "--json");
    while let Some(word) = words.next() {
        match word.as_str() {
            "--diff" => diff = words.next(),
            "--flip" => flip = words.next(),
            _ => files.push(word),
        }
    }
    let [a, b, coverage @ ..] = files.as_slice() else {
        return Err("two images are needed: compare A B [COVERAGE]".into());
    };
    let args = CompareArgs {
        coverage: coverage.first().cloned(),
        diff: diff.map(Into::into),
        flip: flip.map(Into::into),
        ..CompareArgs::new(a, b)
    };
    println!("{}", serde_json::to_string_pretty(&run(&args)?)?);
    Ok(())
}
