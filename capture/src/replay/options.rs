//! The source string of a replay.

use std::path::PathBuf;
use std::time::Duration;

/// How fast a replay goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// So many times as fast as it was recorded: 1 = in real time.
    Times(f64),
    /// As fast as frames are asked for.
    Max,
}

/// Slowest and fastest pace; beyond, stamps in nanoseconds lose their meaning.
pub(super) const RATES: std::ops::RangeInclusive<f64> = 0.001..=1000.0;

/// How a replay begins and goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayOptions {
    /// How fast.
    pub rate: Rate,
    /// Begin again after the last frame.
    pub looping: bool,
    /// Where to begin, counted from the first image of the file.
    pub start: Duration,
}

impl Default for ReplayOptions {
    fn default() -> Self {
        Self { rate: Rate::Times(1.0), looping: false, start: Duration::ZERO }
    }
}

/// `replay:FILE#STREAM?rate=1&loop=true&start_s=2.5`, taken apart.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplaySource {
    /// The recording.
    pub path: PathBuf,
    /// The stream's name or topic, `None` for the only one.
    pub stream: Option<String>,
    /// How it is played, `None` if the source does not say.
    pub options: Option<ReplayOptions>,
}

impl ReplaySource {
    /// Takes apart a source string, with or without `replay:` before it.
    ///
    /// # Errors
    /// Which part is wrong, and what is allowed.
    pub fn parse(source: &str) -> Result<Self, String> {
        let rest = source.strip_prefix("replay:").unwrap_or(source);
        let (rest, options) = match rest.rsplit_once('?') {
            Some((rest, options)) => (rest, Some(parse_options(options)?)),
            None => (rest, None),
        };
        let (path, stream) = match rest.rsplit_once('#') {
            Some((_, "")) => return Err("there is no stream name behind '#'".into()),
            Some((path, stream)) => (path, Some(stream.to_owned())),
            None => (rest, None),
        };
        if path.is_empty() {
            return Err("there is no file name; write replay:FILE#STREAM".into());
        }
        Ok(Self { path: path.into(), stream, options })
    }
}

fn parse_options(text: &str) -> Result<ReplayOptions, String> {
    let mut options = ReplayOptions::default();
    for option in text.split('&').filter(|option| !option.is_empty()) {
        let (key, value) = option.split_once('=').ok_or_else(|| format!("option {option:?} has no value"))?;
        match key {
            "rate" => options.rate = parse_rate(value)?,
            "loop" => {
                options.looping = value.parse().map_err(|_| format!("loop={value}: use true or false"))?
            }
            "start_s" => options.start = parse_start(value)?,
            _ => return Err(format!("unknown option {key:?}; options are rate, loop, start_s")),
        }
    }
    Ok(options)
}

fn parse_rate(value: &str) -> Result<Rate, String> {
    if value == "max" {
        return Ok(Rate::Max);
    }
    let times: Option<f64> = value.parse().ok().filter(|times| RATES.contains(times));
    let allowed = || format!("rate={value}: use a number from {} to {}, or max", RATES.start(), RATES.end());
    times.map(Rate::Times).ok_or_else(allowed)
}

fn parse_start(value: &str) -> Result<Duration, String> {
    let seconds: Option<f64> = value.parse().ok();
    let start = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    start.ok_or_else(|| format!("start_s={value}: use seconds from the start, 0 or more"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_sources_apart() {
        let plain = ReplaySource::parse("replay:desk.mcap").unwrap();
        assert_eq!(plain, ReplaySource { path: "desk.mcap".into(), stream: None, options: None });
        let full = ReplaySource::parse("replay:a#b/x.bag#/cam/image?rate=0.5&loop=true&start_s=1.5").unwrap();
        assert_eq!((full.path, full.stream.as_deref()), ("a#b/x.bag".into(), Some("/cam/image")));
        let options = full.options.unwrap();
        assert_eq!(
            options,
            ReplayOptions { rate: Rate::Times(0.5), looping: true, start: Duration::from_millis(1500) }
        );
        assert_eq!(ReplaySource::parse("x?rate=max").unwrap().options.unwrap().rate, Rate::Max);
    }

    #[test]
    fn says_what_is_wrong() {
        for (source, named) in [
            ("replay:", "file name"),
            ("replay:x#", "stream name"),
            ("replay:x?rate=0", "rate=0"),
            ("replay:x?rate=NaN", "rate=NaN"),
            ("replay:x?rate=-1", "rate=-1"),
            ("replay:x?loop=yes", "loop=yes"),
            ("replay:x?start_s=-2", "start_s=-2"),
            ("replay:x?start_s=inf", "start_s=inf"),
            ("replay:x?speed=2", "speed"),
            ("replay:x?rate", "no value"),
        ] {
            let error = ReplaySource::parse(source).unwrap_err();
            assert!(error.contains(named), "{source}: {error}");
        }
    }
}
