//! The differential path tracer: one camera sample's radiance in both worlds.
//!
//! P. Kán and H. Kaufmann, *Differential Irradiance Caching* (2013), §4: four kinds of rays. A *mixed* ray sees
//! everything, a *real* ray passes through virtual things; each comes as radiance ray and as shadow ray.
//!
//! - A path that exists in both worlds is cast as a mixed ray. On a real surface it goes on in both, in one shared
//!   direction, after a mixed and (if that is blocked) a real shadow ray.
//! - Where it meets something virtual it parts: the mixed half is scattered there, the real half goes straight on to
//!   the real surface behind. Both use the random numbers of the same vertex.
//! - Virtual lights count in the mixed world only, the environment is a real light.
//!
//! # Which paths are counted how
//!
//! L light, E eye, D a scattering event of finite width, S one of a delta lobe (smooth mirror, glass, thin wall). Each
//! path belongs to exactly one row, by what happens between the light and the D next to it:
//!
//! | [`Classes`] | paths | light | counted by |
//! | --- | --- | --- | --- |
//! | `seen` | L S* E | any | eye path: what its rays hit, weight 1 |
//! | `lit` | L D (D\|S)* E | any | light sampling and what the eye path hits after a D, power heuristic |
//! | `environment_caustics` | L S⁺ D (D\|S)* E | environment | eye path: misses after a delta event, weight 1 |
//! | `lamp_caustics` | L S⁺ D (D\|S)* E | lamps, glowing surfaces | photons ([`crate::photon`]), gathered at the D |
//!
//! Glass blocks shadow rays: light through glass is in the last two rows. [`Method::Paths`] counts the last row by eye
//! paths as well (of much more noise for small lamps), [`Method::Photons`] counts the last three by photons; both are
//! there to check the default.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`scene`] | all that is traced |
//! | [`settings`] | classes, method, depth |
//! | [`strand`] | a path on its way |
//! | [`eye_path`] | the walk from the eye |
//! | [`lighting`] | light sampling and its weights |

pub mod eye_path;
pub mod lighting;
pub mod scene;
pub mod settings;
pub mod strand;

pub use eye_path::{EyePath, FirstHit};
pub use scene::{TraceError, TraceScene};
pub use settings::{Classes, Method, Settings};
