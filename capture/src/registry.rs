//! From the name of a source to an open camera.

use std::fmt;

use crate::camera::{Camera, CaptureError};
use crate::images::{self, did_you_mean};
use crate::replay;

/// Opens what follows `scheme:` in the name of a source.
pub type Opener = Box<dyn Fn(&str) -> Result<Box<dyn Camera>, CaptureError> + Send + Sync>;

/// The kinds of source there are. Each crate that has one registers its scheme.
#[derive(Default)]
pub struct SourceRegistry {
    schemes: Vec<Scheme>,
}

struct Scheme {
    name: &'static str,
    example: &'static str,
    open: Opener,
}

impl SourceRegistry {
    /// No schemes.
    pub fn new() -> Self {
        Self::default()
    }

    /// The schemes of this crate.
    pub fn builtin() -> Self {
        let mut registry = Self::new();
        registry.register("images", "images:photos/*.png?fps=30", Box::new(images::open));
        registry.register("replay", "replay:desk.mcap#camera", Box::new(replay::open));
        registry
    }

    /// Adds a scheme, in the place of one of the same name. `example` is shown to users who mistype.
    pub fn register(&mut self, name: &'static str, example: &'static str, open: Opener) {
        self.schemes.retain(|scheme| scheme.name != name);
        self.schemes.push(Scheme { name, example, open });
    }

    /// Names and examples of all schemes, in the order of registration.
    pub fn schemes(&self) -> impl Iterator<Item = (&'static str, &'static str)> + '_ {
        self.schemes.iter().map(|scheme| (scheme.name, scheme.example))
    }

    /// Opens a source named `scheme:rest`.
    ///
    /// # Errors
    /// [`CaptureError::Lost`] for an unknown scheme (it lists the known ones), else what the scheme's opener says.
    pub fn open(&self, uri: &str) -> Result<Box<dyn Camera>, CaptureError> {
        let (name, rest) = uri.split_once(':').ok_or_else(|| self.unknown(uri, "names no kind of source"))?;
        match self.schemes.iter().find(|scheme| scheme.name == name) {
            Some(scheme) => (scheme.open)(rest),
            None => {
                let names: Vec<&str> = self.schemes().map(|(name, _)| name).collect();
                Err(self
                    .unknown(uri, &format!("unknown kind of source `{name}`{}", did_you_mean(name, &names))))
            }
        }
    }

    fn unknown(&self, uri: &str, what: &str) -> CaptureError {
        let examples: Vec<&str> = self.schemes().map(|(_, example)| example).collect();
        let reason = format!("{what}; a source is written like {}", examples.join(" or "));
        CaptureError::Lost { source_name: format!("`{uri}`"), reason }
    }
}

impl fmt::Debug for SourceRegistry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.schemes().map(|(name, _)| name)).finish()
    }
}

/// Opens a source of one of this crate's own schemes.
///
/// # Errors
/// As [`SourceRegistry::open`].
pub fn open(uri: &str) -> Result<Box<dyn Camera>, CaptureError> {
    SourceRegistry::builtin().open(uri)
}
