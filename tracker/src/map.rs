//! Maps: the poses of tags to each other, from many images that each show some of them.
//!
//! Tags that are seen together are chained to each other, each by the one of its [planar poses](crate::planar) on which
//! most images agree; then all tags and all cameras are adjusted together to the pixels of the images (bundle adjustment:
//! Triggs, McLauchlan, Hartley and Fitzgibbon, *Bundle Adjustment – A Modern Synthesis*, 1999). One tag holds the frame.
//!
//! Time grows with the cube of the number of tags and in proportion to the number of views: hundreds of tags and
//! thousands of views are meant.
//!
//! | module | what is there |
//! | --- | --- |
//! | `graph` | which tags are seen together |
//! | `grow` | the first poses of all |
//! | `problem` | the unknowns, and how far observations are from them |
//! | `system` | one step: normal equations without the views |
//! | `adjust` | robust adjustment, step by step |
//! | `closure` | how well the largest loop closes |

mod adjust;
mod closure;
mod graph;
mod grow;
mod problem;
mod system;

use std::collections::BTreeMap;

use coshade_lens::model::{CameraModel, ModelKind};
use nalgebra::{DMatrix, Isometry3, Matrix6, Translation3};

use crate::board::{Board, BoardProvenance, BoardTag};
use crate::body::SIZE_RANGE_M;
use crate::detection::{TagId, TagObservation};
use crate::lie;
use adjust::Adjusted;
pub use closure::{Closure, ClosureError};
use graph::Graph;
use problem::Problem;

/// More tags than these are refused: the time for each step grows with the cube of their number.
pub const MAX_TAGS: usize = 1000;
/// More views than these are refused.
pub const MAX_VIEWS: usize = 100_000;

/// What one image shows.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Number of the image, for messages.
    pub number: u64,
    /// The tags in it. One that is there twice is used at most once.
    pub observations: Vec<TagObservation>,
}

/// How tags are mapped.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MapSettings {
    /// The tag whose frame is the map's; without: the lowest of the largest group that is seen together.
    pub origin: Option<TagId>,
    /// Size of all tags that are not in `sizes_m`; without: that of the first one there.
    pub size_m: Option<f64>,
    /// Tags of known size.
    pub sizes_m: Vec<(TagId, f64)>,
    /// Estimate the sizes of tags that are not in `sizes_m`, starting at `size_m`; if none is there, the origin keeps its.
    pub free_sizes: bool,
    /// Estimate the lens' parameters as well; those of a pinhole as [`ModelKind::BrownConrady5`].
    pub refine_lens: bool,
}

/// Tags and where they are.
#[derive(Clone, Debug)]
pub struct TagMap {
    /// The tag whose frame is the map's.
    pub origin: TagId,
    /// The tags, by family and number.
    pub tags: Vec<MappedTag>,
    /// The views that the map rests on.
    pub views: Vec<MappedView>,
    /// Observations that do not fit and are left out.
    pub rejected: Vec<RejectedObservation>,
    /// Groups of tags that no view connects to the origin, each sorted.
    pub unconnected: Vec<Vec<TagId>>,
    /// Root mean square distance of the corners from where the map puts them.
    pub rms_px: f64,
    /// The same as an angle between rays.
    pub rms_rad: f64,
    /// Sum of squares of the corners' errors in units of what is assumed, per degree of freedom.
    pub reduced_chi2: f64,
    /// Error of each coordinate of a corner that was assumed beside its own so that the median tag fits as it should: what
    /// lens, print and walls add. 0 if their own explains all.
    pub unexplained_px: f64,
    /// The lens as it was given, or as it was estimated.
    pub lens: CameraModel,
    /// Standard deviations of its parameters, if they were estimated.
    pub lens_std: Option<Vec<f64>>,
    /// How the largest loop of tags closes, if there is one of four tags or more.
    pub closure: Option<Closure>,
}

/// A tag of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedTag {
    /// Which tag.
    pub tag: TagId,
    /// Its size.
    pub size_m: f64,
    /// Standard deviation of its size, if that was estimated.
    pub size_std_m: Option<f64>,
    /// Tag to map frame.
    pub map_from_tag: Isometry3<f64>,
    /// Covariance of a twist on its left (see [`crate::lie`]); 0 for the origin. From the corners' errors, those that
    /// were [unexplained](TagMap::unexplained_px) included.
    pub covariance: Matrix6<f64>,
    /// Views that it was used in.
    pub views: usize,
    /// Root mean square distance of its corners from where the map puts them.
    pub rms_px: f64,
}

/// A view of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct MappedView {
    /// Number of the image.
    pub number: u64,
    /// Map to camera frame.
    pub camera_from_map: Isometry3<f64>,
    /// Tags that were used.
    pub tags: Vec<TagId>,
    /// Root mean square distance of their corners from where the map puts them.
    pub rms_px: f64,
}

/// An observation that does not fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RejectedObservation {
    /// Number of the image.
    pub view: u64,
    /// Which tag.
    pub tag: TagId,
    /// Root mean square distance of its corners from where the map puts them; infinite if that is outside the image of the lens.
    pub rms_px: f64,
}

/// Why there is no map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// No view shows two tags.
    #[error(
        "none of {views} views shows two tags, and what one shows says nothing of how they lie to each other"
    )]
    NoPairs {
        /// How many views there are.
        views: usize,
    },
    /// The origin was not seen, or with no other tag.
    #[error("the origin {tag} is not seen together with any other tag")]
    Origin {
        /// The origin.
        tag: TagId,
    },
    /// No size is known.
    #[error("no tag's size is known: give the size of all, or of one")]
    NoSize,
    /// A size is no length.
    #[error("size of {size_m} m; it must be from {} to {} m", SIZE_RANGE_M.start(), SIZE_RANGE_M.end())]
    Size {
        /// The size.
        size_m: f64,
    },
    /// None of the tags of known size is on the map.
    #[error("none of the tags of known size is seen together with the others, so the map has no scale")]
    NoScale,
    /// Too much.
    #[error("{count} {what}; at most {limit} can be mapped")]
    TooMany {
        /// Tags or views.
        what: &'static str,
        /// How many.
        count: usize,
        /// How many may be.
        limit: usize,
    },
    /// A tag has no pose in any view.
    #[error("no view gives a pose of {tag}; check that the calibration belongs to the images")]
    NoPose {
        /// The tag.
        tag: TagId,
    },
    /// A tag fits nowhere.
    #[error(
        "no view of {tag} fits the others; the calibration may not belong to the images (try to refine the lens), its size may be \
         another, or it has moved"
    )]
    NoFit {
        /// The tag.
        tag: TagId,
    },
    /// What is seen does not determine the map.
    #[error("the views do not determine the poses of all tags{}", if *.refine_lens { " and the lens: map without refining the lens" } else { "" })]
    Undetermined {
        /// Whether the lens was to be found too.
        refine_lens: bool,
    },
    /// It was told to stop.
    #[error("stopped")]
    Stopped,
}

/// Where the tags are that `views` show.
///
/// `goes_on` is asked now and then whether to continue.
///
/// # Errors
/// [`MapError`] if views, sizes or lens do not make a map.
pub fn map_tags(
    views: &[View],
    lens: &CameraModel,
    settings: &MapSettings,
    goes_on: &dyn Fn() -> bool,
) -> Result<TagMap, MapError> {
    check_count("views", views.len(), MAX_VIEWS)?;
    let graph = Graph::new(views);
    check_count("tags", graph.tags().len(), MAX_TAGS)?;
    let (group, unconnected) = graph.split(settings.origin, views.len())?;
    let origin =
        settings.origin.or(group.first().copied()).ok_or(MapError::NoPairs { views: views.len() })?;
    let sizes = Sizes::new(settings, origin, &group)?;
    let lens = if settings.refine_lens { free_lens(lens) } else { *lens };
    let job = Job { views, lens, sizes, goes_on, refine_lens: settings.refine_lens };
    let adjusted = job.adjusted(origin, &group)?;
    let closure = closure::measure(&job, &graph, &group, &adjusted.problem.lens)?;
    TagMap::new(origin, adjusted, unconnected, closure)
}

fn check_count(what: &'static str, count: usize, limit: usize) -> Result<(), MapError> {
    if count > limit { Err(MapError::TooMany { what, count, limit }) } else { Ok(()) }
}

/// A pinhole with distortion that is none yet; others have parameters enough.
fn free_lens(lens: &CameraModel) -> CameraModel {
    let mut params = lens.params();
    if lens.kind() != ModelKind::Pinhole {
        return *lens;
    }
    params.extend([0.0; 5]);
    CameraModel::from_params(ModelKind::BrownConrady5, &params).unwrap_or(*lens)
}

/// What is known of sizes.
#[derive(Clone, Debug)]
struct Sizes {
    all_m: f64,
    known_m: BTreeMap<TagId, f64>,
    free: bool,
}

impl Sizes {
    fn new(settings: &MapSettings, origin: TagId, group: &[TagId]) -> Result<Self, MapError> {
        let mut known_m: BTreeMap<TagId, f64> = settings.sizes_m.iter().copied().collect();
        let first = settings.sizes_m.first().map(|(_, size_m)| *size_m);
        let all_m = settings.size_m.or(first).ok_or(MapError::NoSize)?;
        let wrong = known_m.values().chain([&all_m]).find(|size_m| !SIZE_RANGE_M.contains(*size_m));
        if let Some(&size_m) = wrong {
            return Err(MapError::Size { size_m });
        }
        let seen = group.iter().any(|tag| known_m.contains_key(tag));
        if !seen && !known_m.is_empty() && (settings.size_m.is_none() || settings.free_sizes) {
            return Err(MapError::NoScale);
        }
        if settings.free_sizes && known_m.is_empty() {
            known_m.insert(origin, all_m);
        }
        Ok(Self { all_m, known_m, free: settings.free_sizes })
    }

    fn of(&self, tag: TagId) -> f64 {
        self.known_m.get(&tag).copied().unwrap_or(self.all_m)
    }

    fn is_free(&self, tag: TagId) -> bool {
        self.free && !self.known_m.contains_key(&tag)
    }
}

/// Views to be mapped, and what is known beforehand.
struct Job<'a> {
    views: &'a [View],
    lens: CameraModel,
    sizes: Sizes,
    goes_on: &'a dyn Fn() -> bool,
    refine_lens: bool,
}

impl Job<'_> {
    fn check(&self) -> Result<(), MapError> {
        if (self.goes_on)() { Ok(()) } else { Err(MapError::Stopped) }
    }

    /// The map of a group of tags that are connected.
    fn adjusted(&self, origin: TagId, group: &[TagId]) -> Result<Adjusted, MapError> {
        adjust::adjust(grow::grow(self, origin, group)?, self)
    }

    /// The same of some of the views.
    fn of<'b>(&'b self, views: &'b [View], lens: CameraModel) -> Job<'b> {
        Job { views, lens, sizes: self.sizes.clone(), goes_on: self.goes_on, refine_lens: false }
    }
}

impl TagMap {
    fn new(
        origin: TagId,
        adjusted: Adjusted,
        unconnected: Vec<Vec<TagId>>,
        closure: Option<Closure>,
    ) -> Result<Self, MapError> {
        let Adjusted { problem, weights, covariance, reduced_chi2, unexplained_px } = adjusted;
        let errors = problem.errors(&weights);
        let tag = |(index, tag): (usize, &problem::Tag)| {
            let used = errors.iter().filter(|error| error.tag == index && error.used);
            let variance = tag.free_size.then(|| covariance[(7 * index + 6, 7 * index + 6)]);
            MappedTag {
                tag: tag.tag,
                size_m: tag.size_m,
                // The unknown is the size's logarithm.
                size_std_m: variance.map(|variance| tag.size_m * variance.max(0.0).sqrt()),
                map_from_tag: tag.map_from_tag,
                covariance: about_origin(&covariance, index, &tag.map_from_tag),
                views: used.clone().count(),
                rms_px: problem::rms(used.map(|error| error.square_px2)),
            }
        };
        let mut tags: Vec<MappedTag> = problem.tags.iter().enumerate().map(tag).collect();
        tags.sort_by_key(|tag| tag.tag);
        let view = |(index, view): (usize, &problem::Camera)| {
            let used = errors.iter().filter(|error| error.view == index && error.used);
            MappedView {
                number: view.number,
                camera_from_map: view.camera_from_map,
                tags: used.clone().filter_map(|error| Some(problem.tags.get(error.tag)?.tag)).collect(),
                rms_px: problem::rms(used.map(|error| error.square_px2)),
            }
        };
        let rejected = errors.iter().filter(|error| !error.used).filter_map(|error| {
            Some(RejectedObservation {
                view: problem.cameras.get(error.view)?.number,
                tag: problem.tags.get(error.tag)?.tag,
                rms_px: (error.square_px2 / 4.0).sqrt(),
            })
        });
        let used = || errors.iter().filter(|error| error.used);
        let lens_from = 7 * problem.tags.len();
        Ok(Self {
            origin,
            tags,
            views: problem.cameras.iter().enumerate().map(view).collect(),
            rejected: rejected.collect(),
            unconnected,
            rms_px: problem::rms(used().map(|error| error.square_px2)),
            rms_rad: problem::rms(used().map(|error| error.square_rad2)),
            reduced_chi2,
            unexplained_px,
            lens_std: problem.free_lens.then(|| {
                (lens_from..covariance.nrows()).map(|i| covariance[(i, i)].max(0.0).sqrt()).collect()
            }),
            lens: problem.lens,
            closure,
        })
    }

    /// The tag of that name.
    pub fn tag(&self, tag: TagId) -> Option<&MappedTag> {
        self.tags.iter().find(|own| own.tag == tag)
    }

    /// As a board file.
    pub fn board(&self, provenance: BoardProvenance) -> Board {
        let family = self.origin.family;
        let placed = |tag: &MappedTag| BoardTag {
            family: (tag.tag.family != family).then_some(tag.tag.family),
            ..BoardTag::placed(tag.tag.id, tag.size_m, &tag.map_from_tag)
        };
        let tags = self.tags.iter().map(placed).collect();
        Board { version: crate::board::VERSION, family, tags, provenance: Some(provenance) }
    }
}

impl MappedTag {
    /// Standard deviations of its centre, along the map's axes, in metres.
    pub fn position_std_m(&self) -> [f64; 3] {
        let centre = Isometry3::from(self.map_from_tag.translation).inverse();
        let about_centre = lie::adjoint(&centre);
        let covariance = about_centre * self.covariance * about_centre.transpose();
        [3, 4, 5].map(|i| covariance[(i, i)].max(0.0).sqrt())
    }

    /// Standard deviations of its rotation about the map's axes, in radians.
    pub fn rotation_std_rad(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.covariance[(i, i)].max(0.0).sqrt())
    }
}

/// The covariance of a tag's pose: the unknowns turn it about its centre, twists of the crate about the map's origin.
fn about_origin(covariance: &DMatrix<f64>, index: usize, map_from_tag: &Isometry3<f64>) -> Matrix6<f64> {
    let own: Matrix6<f64> = covariance.fixed_view::<6, 6>(7 * index, 7 * index).into_owned();
    let carried = lie::adjoint(&Isometry3::from(Translation3::from(map_from_tag.translation.vector)));
    let covariance = carried * own * carried.transpose();
    (covariance + covariance.transpose()) / 2.0
}

impl From<&Problem> for BTreeMap<TagId, Isometry3<f64>> {
    fn from(problem: &Problem) -> Self {
        problem.tags.iter().map(|tag| (tag.tag, tag.map_from_tag)).collect()
    }
}
