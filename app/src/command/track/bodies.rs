//! What is to be looked for: bodies of tags, each tag in one of them.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use coshade_scene::session::Session;
use coshade_scene::session::placement::{Placement, PoseSpec, Tag};
use coshade_scene::session::tracking::{AnchorTarget, NamedUp, Up};
use coshade_tracker::{Board, Body, TagId};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// The bodies to look for.
#[derive(Debug, Default)]
pub struct Bodies {
    /// No tag is in two of them.
    pub list: Vec<Body>,
    /// The one that the world is fixed to.
    pub anchor: Option<Anchor>,
}

/// What the world is fixed to.
#[derive(Clone, Debug)]
pub struct Anchor {
    /// Name of the body.
    pub body: String,
    /// How it lies.
    pub world_from_body: Isometry3<f64>,
}

impl Anchor {
    /// The body of `list` that carries the anchor's tags: itself, or a larger one if it is a single tag.
    fn find(list: &[Body], anchor: &Body, world_from_anchor: Isometry3<f64>) -> Option<Self> {
        let own = anchor.tags.first()?;
        let (body, tag) = list.iter().find_map(|body| Some((body, body.tag(own.tag)?)))?;
        let anchor_from_body = own.body_from_tag * tag.body_from_tag.inverse();
        Some(Self { body: body.name.clone(), world_from_body: world_from_anchor * anchor_from_body })
    }
}

/// A body, and who asks for it.
struct Wanted {
    body: Body,
    by: String,
}

impl Bodies {
    /// All that a session attaches anything to.
    ///
    /// # Errors
    /// Name the file and the keys that contradict each other or cannot be followed.
    pub fn of_session(session: &Session) -> anyhow::Result<Self> {
        let (spec, path) = (session.spec(), session.path());
        let Some(tracking) = &spec.tracking else {
            bail!(
                "{}: nothing to track: write [tracking] anchor = {{ board = \"board.toml\", up = \"z\" }}",
                path.display()
            );
        };
        let anchor = match &tracking.anchor.target {
            AnchorTarget::Board { board } => board_body(session.resolve(board), board)?,
            AnchorTarget::Tag(tag) => tag_body(tag)?,
        };
        let world_from_anchor = world_from_anchor(&tracking.anchor.up)
            .with_context(|| format!("{}: tracking.anchor.up", path.display()))?;
        let mut wanted = vec![Wanted { body: anchor.clone(), by: "tracking.anchor".to_owned() }];
        for (index, tag) in tracking.tags.iter().enumerate() {
            wanted.push(Wanted { body: tag_body(tag)?, by: format!("tracking.tags[{index}]") });
        }
        let things = spec.things.iter().map(|thing| (&thing.pose, format!("thing `{}`", thing.name)));
        let lights = spec.lights.iter().enumerate().map(|(i, light)| (&light.pose, format!("light[{i}]")));
        for (pose, by) in things.chain(lights) {
            let body = match pose {
                PoseSpec::World { .. } => continue,
                PoseSpec::Marker { tag, .. } => tag_body(tag)?,
                PoseSpec::Board { board: file, .. } | PoseSpec::Body { body: file, .. } => {
                    board_body(session.resolve(file), file)?
                }
            };
            wanted.push(Wanted { body, by });
        }
        let list = disjoint(wanted).with_context(|| path.display().to_string())?;
        let anchor = Anchor::find(&list, &anchor, world_from_anchor);
        Ok(Self { list, anchor })
    }

    /// Boards and single tags; the first of them lies flat at the world's origin.
    ///
    /// # Errors
    /// A file that is no board; a tag that is in two bodies.
    pub fn of_arguments(boards: &[PathBuf], tags: &[(TagId, f64)]) -> anyhow::Result<Self> {
        let mut wanted = Vec::new();
        for file in boards {
            let body = board_body(file.clone(), file)?;
            wanted.push(Wanted { body, by: format!("--board {}", file.display()) });
        }
        for &(tag, size_m) in tags {
            wanted.push(Wanted { body: Body::single(tag, size_m), by: format!("--tag {tag}") });
        }
        let first = wanted.first().map(|wanted| wanted.body.clone());
        let list = disjoint(wanted)?;
        let anchor = first.and_then(|first| Anchor::find(&list, &first, Isometry3::identity()));
        Ok(Self { list, anchor })
    }
}

fn board_body(path: PathBuf, name: &Path) -> anyhow::Result<Body> {
    let board = Board::read(&path)?;
    Body::from_board(name.display().to_string(), &board).with_context(|| path.display().to_string())
}

fn tag_body(tag: &Tag) -> anyhow::Result<Body> {
    Ok(Body::single(TagId { family: tag.family.parse()?, id: tag.id }, tag.size_m))
}

/// Each body once; a single tag that belongs to a larger body is followed with that.
fn disjoint(wanted: Vec<Wanted>) -> anyhow::Result<Vec<Body>> {
    // The larger ones first, so that the single tags find them; otherwise in the order given.
    let (large, single): (Vec<_>, Vec<_>) = wanted.into_iter().partition(|wanted| wanted.body.tags.len() > 1);
    let mut kept: Vec<Wanted> = Vec::new();
    for wanted in large.into_iter().chain(single) {
        let shared = kept.iter().find_map(|kept| {
            let tag = wanted.body.tags.iter().find_map(|tag| kept.body.tag(tag.tag))?;
            Some((kept, *tag))
        });
        let Some((other, tag)) = shared else {
            kept.push(wanted);
            continue;
        };
        if let Some(own) = wanted.body.tag(tag.tag).filter(|own| own.size_m != tag.size_m) {
            bail!(
                "{} is {} m wide for {} and {} m for {}: one tag has one size",
                tag.tag,
                tag.size_m,
                other.by,
                own.size_m,
                wanted.by
            );
        }
        if wanted.body.tags.len() > 1 && wanted.body.tags != other.body.tags {
            bail!(
                "{} is in {} and in {}: one tag is on one body",
                tag.tag,
                other.body.name,
                wanted.body.name
            );
        }
    }
    Ok(kept.into_iter().map(|kept| kept.body).collect())
}

/// In double precision.
fn world_from_anchor(up: &Up) -> anyhow::Result<Isometry3<f64>> {
    let quarter = std::f64::consts::FRAC_PI_2;
    match up {
        Up::Named(NamedUp::Z) => Ok(Isometry3::identity()),
        // The print's y becomes the world's z.
        Up::Named(NamedUp::Y) => Ok(Isometry3::rotation(Vector3::x() * quarter)),
        Up::Named(NamedUp::Plane) => bail!(
            "`plane` needs a depth image, which `coshade track` does not look at: write \"z\" if the print lies flat, \"y\" if \
             it stands, or a pose"
        ),
        Up::Pose(placement) => isometry(placement),
    }
}

fn isometry(placement: &Placement) -> anyhow::Result<Isometry3<f64>> {
    let [x, y, z, w] = placement.rotation()?.to_array();
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    Ok(Isometry3::from_parts(Translation3::from(placement.position_m), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn session(folder: &Path, text: &str) -> Session {
        let board = "version = 1\nfamily = \"tag36h11\"\n[[tag]]\nid = 1\nsize_m = 0.04\nposition_m = [-0.03, 0]\n\
                     [[tag]]\nid = 2\nsize_m = 0.04\nposition_m = [0.03, 0]\n";
        std::fs::write(folder.join("board.toml"), board).unwrap();
        let text = format!("version = 1\n[camera]\nsource = \"sim:x.toml#camera\"\n{text}");
        Session::parse(&text, folder.join("session.toml")).unwrap()
    }

    const THING: &str = "[[thing]]\nname = \"cup\"\nworld = \"virtual\"\nshape = { sphere = 0.05 }\npose = ";

    #[test]
    fn a_body_is_followed_once_whoever_asks_for_it() {
        let folder = tempfile::tempdir().unwrap();
        let marker = |id, size_m| {
            format!("{THING}{{ in = \"marker\", family = \"tag36h11\", id = {id}, size_m = {size_m} }}\n")
        };
        let more = "tags = [{ family = \"tag36h11\", id = 7, size_m = 0.05 }]\n".to_owned();
        let tracking = "[tracking]\nanchor = { board = \"board.toml\", up = \"y\" }\n".to_owned() + &more;
        // 7 is asked for twice, 2 is on the board.
        for (thing, size_m) in [(7, "0.05"), (2, "0.04")] {
            let session = session(folder.path(), &(tracking.clone() + &marker(thing, size_m)));
            let bodies = Bodies::of_session(&session).unwrap();
            let names: Vec<_> = bodies.list.iter().map(|body| body.name.as_str()).collect();
            assert_eq!(names, ["board.toml", "tag36h11 7"]);
            let anchor = bodies.anchor.unwrap();
            assert_eq!(anchor.body, "board.toml");
            assert!((anchor.world_from_body * Vector3::y() - Vector3::z()).norm() < 1e-15);
        }
        let session = session(folder.path(), &(tracking + &marker(2, "0.05")));
        let error = format!("{:#}", Bodies::of_session(&session).unwrap_err());
        for text in ["session.toml", "tag36h11 2", "0.04", "0.05", "tracking.anchor", "thing `cup`"] {
            assert!(error.contains(text), "{text}: {error}");
        }
    }

    #[test]
    fn what_cannot_be_followed_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let plane = "[tracking]\nanchor = { board = \"board.toml\", up = \"plane\" }\n";
        let error = format!("{:#}", Bodies::of_session(&session(folder.path(), plane)).unwrap_err());
        assert!(error.contains("tracking.anchor.up") && error.contains("depth image"), "{error}");
        let error = format!("{:#}", Bodies::of_session(&session(folder.path(), "")).unwrap_err());
        assert!(error.contains("[tracking] anchor"), "{error}");
    }

    #[test]
    fn a_tag_of_a_board_can_hold_the_world() {
        let folder = tempfile::tempdir().unwrap();
        let text = "[tracking]\nanchor = { family = \"tag36h11\", id = 2, size_m = 0.04 }\n".to_owned()
            + THING
            + "{ in = \"board\", board = \"board.toml\" }\n";
        let bodies = Bodies::of_session(&session(folder.path(), &text)).unwrap();
        assert_eq!(bodies.list.len(), 1);
        let anchor = bodies.anchor.unwrap();
        // Tag 2 lies 3 cm to the right of the board's centre: the centre is 3 cm to the left of the world's.
        assert_eq!(anchor.body, "board.toml");
        assert!((anchor.world_from_body.translation.vector - Vector3::new(-0.03, 0.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn two_bodies_cannot_share_a_tag() {
        let folder = tempfile::tempdir().unwrap();
        session(folder.path(), "");
        let (one, other) = (folder.path().join("board.toml"), folder.path().join("other.toml"));
        let moved = std::fs::read_to_string(&one).unwrap().replace("0.03, 0]", "0.05, 0]");
        std::fs::write(&other, moved).unwrap();
        let error = Bodies::of_arguments(&[one.clone(), other], &[]).unwrap_err().to_string();
        assert!(error.contains("tag36h11 1 is in") && error.contains("other.toml"), "{error}");
        assert_eq!(Bodies::of_arguments(&[one.clone(), one], &[]).unwrap().list.len(), 1);
    }
}
