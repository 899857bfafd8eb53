//! Writes the mutations of a seed file as files: `corpus SEED FOLDER [COUNT]`.

use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [seed, folder, rest @ ..] = &args[..] else {
        return Err("usage: corpus SEED FOLDER [COUNT]".into());
    };
    let count = rest.first().map_or(Ok(200), |count| count.parse())?;
    let name = Path::new(seed).file_name().ok_or("SEED must be a file")?.to_string_lossy().into_owned();
    let bytes = std::fs::read(seed)?;
    std::fs::create_dir_all(folder)?;
    for (n, mutated) in coshade_testdata::mutate::mutations(&bytes, count) {
        std::fs::write(Path::new(folder).join(format!("{n:04}-{name}")), mutated)?;
    }
    Ok(())
}
