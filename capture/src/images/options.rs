//! The options of an `images:` source.

use std::time::Duration;

/// What `images:PATH?key=value&key=value` asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct ImagesOptions {
    /// File, folder or glob pattern.
    pub path: String,
    /// `fps`: frames a second, default 30. Not for TUM folders: their files hold the times.
    pub frames_per_second: Option<f64>,
    /// `pace`: `realtime` (default) or `fast`.
    pub pace: Pace,
    /// `loop`: begin again after the last frame, default `false`.
    pub repeat: bool,
    /// `as`: `native` (default), `grey` or `rgb`.
    pub deliver: Deliver,
    /// `layer`: which layer of EXR files; without it the only one, or the one without a name.
    pub layer: Option<String>,
    /// `depth_unit_m`: metres a count; the images are depth then and must be 16 bit grey.
    pub depth_unit_m: Option<f64>,
    /// `depth_invalid`: a code that means "no measurement" beside 0, as 65535 in 7-Scenes.
    pub depth_invalid: Option<u16>,
    /// `layout`: `files` (default) or `tum`.
    pub layout: Layout,
    /// `stream`: `rgb` (default) or `depth` of a TUM folder.
    pub stream: TumStream,
    /// `associate_s`: only frames of a TUM folder that have a partner in the other stream within this time.
    pub associate: Option<Duration>,
}

/// When frames are delivered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// As a camera would.
    #[default]
    Realtime,
    /// As fast as they are asked for.
    Fast,
}

/// What is made of the images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Deliver {
    /// What the files hold: JPEG as MJPG frames, grey as GREY or Y16, colour as RGB24, linear light as RGBF32.
    #[default]
    Native,
    /// 8 bit luminance, of linear light sRGB-encoded.
    Grey,
    /// 8 bit R′G′B′, of linear light sRGB-encoded.
    Rgb,
}

/// How the files of a folder belong together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Each image is a frame.
    #[default]
    Files,
    /// `rgb.txt` and `depth.txt` list files and times, as the TUM RGB-D benchmark has it.
    Tum,
}

/// One of the two streams of a TUM folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TumStream {
    /// Colour images.
    #[default]
    Rgb,
    /// Depth images of 1/5000 m a count.
    Depth,
}

const KEYS: [&str; 10] = [
    "fps",
    "pace",
    "loop",
    "as",
    "layer",
    "depth_unit_m",
    "depth_invalid",
    "layout",
    "stream",
    "associate_s",
];

impl ImagesOptions {
    /// Options for `path` with every default.
    pub fn new(path: &str) -> Self {
        Self {
            path: path.to_owned(),
            frames_per_second: None,
            pace: Pace::default(),
            repeat: false,
            deliver: Deliver::default(),
            layer: None,
            depth_unit_m: None,
            depth_invalid: None,
            layout: Layout::default(),
            stream: TumStream::default(),
            associate: None,
        }
    }

    /// Reads what follows `images:`.
    ///
    /// Options begin behind the last `?` that is followed by `key=`; any other `?` is the wildcard of glob patterns.
    ///
    /// # Errors
    /// A sentence that names the option and what it may be.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (path, query) = split_query(text);
        let mut options = Self::new(path);
        let mut given = Vec::new();
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair
                .split_once('=')
                .ok_or_else(|| format!("option `{pair}` has no value: write {pair}=…"))?;
            if given.contains(&key) {
                return Err(format!("option `{key}` is given twice"));
            }
            given.push(key);
            options.set(key, value)?;
        }
        options.check(&given)?;
        Ok(options)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match key {
            "fps" => self.frames_per_second = Some(number(key, value, 1e-3..=1e4)?),
            "pace" => self.pace = one_of(key, value, &[("realtime", Pace::Realtime), ("fast", Pace::Fast)])?,
            "loop" => self.repeat = one_of(key, value, &[("true", true), ("false", false)])?,
            "as" => {
                let kinds = [("native", Deliver::Native), ("grey", Deliver::Grey), ("rgb", Deliver::Rgb)];
                self.deliver = one_of(key, value, &kinds)?;
            }
            "layer" => self.layer = Some(value.to_owned()),
            "depth_unit_m" => self.depth_unit_m = Some(number(key, value, 1e-9..=1e3)?),
            "depth_invalid" => {
                let code =
                    value.parse().map_err(|_| format!("`depth_invalid={value}`: a code from 1 to 65535"))?;
                self.depth_invalid = Some(code);
            }
            "layout" => self.layout = one_of(key, value, &[("files", Layout::Files), ("tum", Layout::Tum)])?,
            "stream" => {
                self.stream = one_of(key, value, &[("rgb", TumStream::Rgb), ("depth", TumStream::Depth)])?
            }
            "associate_s" => self.associate = Some(Duration::from_secs_f64(number(key, value, 0.0..=1e3)?)),
            _ => return Err(format!("unknown option `{key}`{}", did_you_mean(key, &KEYS))),
        }
        Ok(())
    }

    /// Options that contradict each other would be ignored silently otherwise.
    fn check(&self, given: &[&str]) -> Result<(), String> {
        if self.layout == Layout::Files {
            if let Some(key) = given.iter().find(|key| ["stream", "associate_s"].contains(key)) {
                return Err(format!("option `{key}` is for layout=tum"));
            }
        } else if self.frames_per_second.is_some() {
            return Err("option `fps`: a TUM folder has its own times; leave it out or use pace=fast".into());
        }
        let is_tum_depth = self.layout == Layout::Tum && self.stream == TumStream::Depth;
        if self.layout == Layout::Tum && self.stream == TumStream::Rgb && self.depth_unit_m.is_some() {
            return Err("option `depth_unit_m` is for stream=depth".into());
        }
        let is_depth = is_tum_depth || self.depth_unit_m.is_some();
        if is_depth && self.layer.is_some() {
            return Err("option `layer` is for EXR images; depth is 16 bit grey and has none".into());
        }
        if is_depth && self.deliver != Deliver::Native {
            return Err("option `as`: depth is delivered as Z16; leave out `as`, or the depth unit".into());
        }
        if !is_depth && self.depth_invalid.is_some() {
            return Err("option `depth_invalid` needs `depth_unit_m`".into());
        }
        Ok(())
    }
}

fn split_query(text: &str) -> (&str, &str) {
    let options_follow = |rest: &str| {
        let key = rest.split('=').next().unwrap_or_default();
        rest.contains('=') && !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    match text.rsplit_once('?') {
        Some((path, query)) if options_follow(query) => (path, query),
        _ => (text, ""),
    }
}

fn number(key: &str, value: &str, allowed: std::ops::RangeInclusive<f64>) -> Result<f64, String> {
    let parsed: Option<f64> = value.parse().ok();
    parsed.filter(|number| allowed.contains(number)).ok_or_else(|| {
        format!("`{key}={value}`: a number from {} to {}, such as 0.001", allowed.start(), allowed.end())
    })
}

fn one_of<T: Copy>(key: &str, value: &str, choices: &[(&str, T)]) -> Result<T, String> {
    let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
    let chosen = choices.iter().find(|(name, _)| *name == value).map(|(_, choice)| *choice);
    chosen.ok_or_else(|| {
        format!("`{key}={value}`: must be {}{}", names.join(" or "), did_you_mean(value, &names))
    })
}

/// `, did you mean …?` if one of `known` is near, else what there is.
pub(crate) fn did_you_mean(word: &str, known: &[&str]) -> String {
    let nearest = known.iter().min_by_key(|known| strsim::damerau_levenshtein(word, known));
    match nearest {
        Some(nearest) if strsim::damerau_levenshtein(word, nearest) <= 1 + word.len() / 3 => {
            format!(", did you mean `{nearest}`?")
        }
        _ => format!(", there are: {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read_and_wildcards_stay_wildcards() {
        let options = ImagesOptions::parse("a?b/?.png?fps=12.5&loop=true&pace=fast&as=grey").unwrap();
        assert_eq!(options.path, "a?b/?.png");
        assert_eq!(options.frames_per_second, Some(12.5));
        assert!(options.repeat && options.pace == Pace::Fast && options.deliver == Deliver::Grey);
        assert_eq!(ImagesOptions::parse("img?.png").unwrap(), ImagesOptions::new("img?.png"));
        let tum = ImagesOptions::parse("desk?layout=tum&stream=depth&associate_s=0.02").unwrap();
        assert_eq!(tum.associate, Some(Duration::from_millis(20)));
    }

    #[test]
    fn wrong_options_are_named() {
        for (text, message) in [
            ("x?fsp=30", "unknown option `fsp`, did you mean `fps`?"),
            ("x?loop=yes", "`loop=yes`: must be true or false"),
            ("x?as=gray", "must be native or grey or rgb, did you mean `grey`?"),
            ("x?fps=0", "`fps=0`: a number from 0.001 to 10000"),
            ("x?fps=nan", "`fps=nan`: a number"),
            ("x?depth_unit_m=-1", "`depth_unit_m=-1`: a number"),
            ("x?fps=1&fps=2", "`fps` is given twice"),
            ("x?fps=1&loop", "`loop` has no value"),
            ("x?stream=rgb", "`stream` is for layout=tum"),
            ("x?layout=tum&fps=30", "a TUM folder has its own times"),
            ("x?depth_unit_m=0.001&layer=Z", "option `layer` is for EXR images"),
            ("x?depth_unit_m=0.001&as=grey", "depth is delivered as Z16"),
            ("x?depth_invalid=65535", "`depth_invalid` needs `depth_unit_m`"),
            ("x?depth_unit_m=0.001&depth_invalid=70000", "a code from 1 to 65535"),
        ] {
            let error = ImagesOptions::parse(text).unwrap_err();
            assert!(error.contains(message), "{text}: {error}");
        }
    }
}
