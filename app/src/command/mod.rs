//! One module a subcommand. Each returns its exit code: 0 = fine, 1 = it ran and found something wrong; an
//! error (2) means it could not run.

pub mod board;
pub mod compare;
pub mod doctor;
pub mod export;
pub mod info;
pub mod map;
pub mod print;
pub mod record;
pub mod reference;
pub mod replay;
pub mod sheet;
pub mod simulate;
pub mod traced;
pub mod track;

/// A length of time, of an argument in seconds: ten years at most, so that sums with it stay in range.
fn seconds(text: &str) -> Result<std::time::Duration, String> {
    const MAX_S: f64 = 10.0 * 365.25 * 86_400.0;
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=MAX_S).contains(&seconds) => Ok(std::time::Duration::from_secs_f64(seconds)),
        _ => Err("a number of seconds, 0 or more, such as 2.5".to_owned()),
    }
}
