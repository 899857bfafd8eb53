//! From a world to a scene: things and lights as in a session, and prints as things of their own.

use std::path::PathBuf;
use std::sync::Arc;

use coshade_config::{Document, KeyPath, Problem};
use coshade_scene::session::placement::Placement;
use coshade_scene::session::render::RenderSpec;
use coshade_scene::session::sensors::CameraSpec;
use coshade_scene::session::tracking::{Anchor, AnchorTarget, TrackingSpec};
use coshade_scene::session::{Session, SessionSpec};
use coshade_scene::shape::Shape;
use coshade_scene::texture::Filter;
use coshade_scene::{ColorSpace, Image, Material, Pose, Similarity, Texture, Thing, World as Membership};
use coshade_tracker::{TagBitmap, tag_bitmap};
use glam::{DVec3, Vec2, Vec3};

use super::WorldError;
use super::spec::WorldSpec;
use crate::pose::Rigid;

/// Codes of black and white print, so that linear albedos are 0.04 and 0.85.
const INK: u8 = 10;
const PAPER: u8 = 217;

/// A tag in its true place.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedTag {
    /// Family.
    pub family: String,
    /// Number within it.
    pub id: u32,
    /// Side of the square through its detected corners.
    pub size_m: f64,
    /// Where it is.
    pub world_from_tag: Rigid,
}

impl PlacedTag {
    /// The four corners as the AprilTag library orders them: lower left, lower right, upper right, upper left of the print;
    /// in the world, metres.
    pub fn corners_m(&self) -> [DVec3; 4] {
        let half = self.size_m / 2.0;
        let corner =
            |x: f64, y: f64| self.world_from_tag.transform_point(DVec3::new(x * half, y * half, 0.0));
        [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
    }
}

/// The session that describes the world's things, lights and environment: its rules are theirs.
fn session_spec(spec: &WorldSpec) -> SessionSpec {
    let anchor =
        Anchor { target: AnchorTarget::Board { board: PathBuf::from("board.toml") }, up: Default::default() };
    SessionSpec {
        version: 1,
        rig: None,
        camera: CameraSpec {
            source: "sim:world.toml#camera".into(),
            calibration: None,
            pose: None,
            controls: None,
        },
        fisheye: None,
        environment: spec.environment.clone(),
        depth: None,
        tracking: Some(TrackingSpec { anchor, tags: Vec::new(), filter: true }),
        things: spec.things.clone(),
        lights: spec.lights.clone(),
        render: RenderSpec::default(),
    }
}

/// What a session would find wrong with things, lights and environment, at their places in the world's file.
pub(super) fn problems(document: &Document<WorldSpec>) -> Vec<Problem> {
    match Session::new(&session_spec(document.value()), document.path()) {
        Ok(_) => Vec::new(),
        Err(error) if error.problems().is_empty() => {
            vec![document.error_at(KeyPath::root(), error.to_string(), "")]
        }
        Err(error) => error.problems().iter().map(|problem| moved(document, problem)).collect(),
    }
}

/// A problem of the session, in the world's file.
fn moved(document: &Document<WorldSpec>, problem: &Problem) -> Problem {
    let steps: Vec<&str> = problem.key.split(['.', '[', ']']).filter(|step| !step.is_empty()).collect();
    document.error_at(steps.as_slice(), problem.message.clone(), problem.help.clone().unwrap_or_default())
}

/// `frame_from_thing` of a placement that was checked.
pub(super) fn rigid(placement: &Placement) -> Rigid {
    Rigid {
        rotation: placement.rotation().unwrap_or_default(),
        position_m: DVec3::from_array(placement.position_m),
    }
}

/// Everything that is there: things, lights and prints.
pub(super) fn assemble(
    document: &Document<WorldSpec>,
    tags: &[PlacedTag],
) -> Result<coshade_scene::Scene, WorldError> {
    let invalid = |problems: Vec<Problem>| match Document::<WorldSpec>::reject(problems) {
        Err(error) => WorldError::File(error),
        Ok(_) => WorldError::Nothing(document.path()),
    };
    let session = Session::new(&session_spec(document.value()), document.path())?;
    let assembled = session
        .assemble()
        .map_err(|error| invalid(error.problems.iter().map(|problem| moved(document, problem)).collect()))?;
    for warning in &assembled.warnings {
        tracing::warn!("{}: {}", warning.key, warning.message);
    }
    if let Some(&index) = assembled.lights_to_fit.first() {
        let at = KeyPath::root().key("light").index(index).key("fit");
        return Err(invalid(vec![document.error_at(
            &at,
            "the truth is not measured",
            "give the light's strength",
        )]));
    }
    let mut scene = assembled.scene;
    for tag in tags {
        scene.things.push(print(tag)?);
    }
    Ok(scene)
}

/// A tag as a thing.
fn print(tag: &PlacedTag) -> Result<Thing, WorldError> {
    let unusable = |reason: String| WorldError::Tag { family: tag.family.clone(), id: tag.id, reason };
    let family = tag
        .family
        .parse()
        .map_err(|error: coshade_tracker::family::UnknownFamily| unusable(error.to_string()))?;
    let bitmap = tag_bitmap(family, tag.id).map_err(|error| unusable(error.to_string()))?;
    let side_m = bitmap.side_m(tag.size_m) as f32;
    let mesh =
        Shape::Plane { size_m: Vec2::splat(side_m) }.mesh().map_err(|error| unusable(error.to_string()))?;
    let name = format!("{} {}", tag.family, tag.id);
    let mut texture = Texture::new(Arc::new(picture(&bitmap, name.clone())), ColorSpace::Linear);
    (texture.magnify, texture.minify) = (Filter::Nearest, Filter::Nearest);
    (texture.wrap_u, texture.wrap_v) =
        (coshade_scene::texture::Wrap::ClampToEdge, coshade_scene::texture::Wrap::ClampToEdge);
    let material = Material { base_color_texture: Some(Arc::new(texture)), ..Material::diffuse(Vec3::ONE) };
    Ok(Thing {
        name,
        world: Membership::Real,
        mesh: Arc::new(mesh),
        materials: vec![Arc::new(material)],
        pose: Pose::World(tag.world_from_tag.similarity()),
        hide_marker: false,
    })
}

fn picture(bitmap: &TagBitmap, name: String) -> Image {
    let code = |white: bool| if white { PAPER } else { INK };
    let rgba =
        bitmap.white.iter().flat_map(|white| [code(*white), code(*white), code(*white), 255]).collect();
    Image { name, width: bitmap.cells, height: bitmap.cells, rgba }
}

/// The true place of what a thing is attached to.
pub(super) fn world_from_frame(
    pose: &Pose,
    tags: &[PlacedTag],
    boards: &[(PathBuf, Rigid)],
) -> Option<Similarity> {
    match pose {
        Pose::World(_) => Some(Similarity::IDENTITY),
        Pose::Marker { family, id, .. } => {
            let tag = tags.iter().find(|tag| tag.family == *family && tag.id == *id)?;
            Some(tag.world_from_tag.similarity())
        }
        Pose::Board { board, .. } => {
            let (_, world_from_board) = boards.iter().find(|(file, _)| file == board)?;
            Some(world_from_board.similarity())
        }
        Pose::Body { .. } => None,
    }
}
