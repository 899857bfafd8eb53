//! What is said about a map.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use coshade_tracker::TagId;
use coshade_tracker::map::{ClosureError, MappedTag, TagMap};
use serde::Serialize;

use super::Args;
use super::sight::Sights;
use crate::command::track::rows::PoseRow;

/// The figures of a map.
#[derive(Serialize)]
pub struct Summary {
    input: String,
    output: PathBuf,
    origin: String,
    images: usize,
    images_damaged: u64,
    images_with_tags: usize,
    images_used: usize,
    tags: Vec<TagRow>,
    views: Vec<ViewRow>,
    rejected: Vec<RejectedRow>,
    unconnected: Vec<Vec<String>>,
    rms_px: f64,
    rms_mrad: f64,
    reduced_chi2: f64,
    unexplained_px: f64,
    lens: LensRow,
    closure: Option<ClosureRow>,
    /// What a user should know before trusting the map.
    pub warnings: Vec<String>,
}

#[derive(Serialize)]
struct TagRow {
    family: &'static str,
    id: u32,
    size_m: f64,
    size_std_m: Option<f64>,
    #[serde(flatten)]
    pose: PoseRow,
    position_std_mm: [f64; 3],
    rotation_std_deg: [f64; 3],
    covariance: [[f64; 6]; 6],
    views: usize,
    rms_px: f64,
}

#[derive(Serialize)]
struct ViewRow {
    image: u64,
    seen: Vec<String>,
    used: Vec<String>,
    rms_px: Option<f64>,
    camera_from_map: Option<PoseRow>,
}

#[derive(Serialize)]
struct RejectedRow {
    image: u64,
    tag: String,
    rms_px: Option<f64>,
}

#[derive(Serialize)]
struct LensRow {
    model: &'static str,
    params: BTreeMap<&'static str, f64>,
    params_std: Option<BTreeMap<&'static str, f64>>,
}

#[derive(Serialize)]
struct ClosureRow {
    tags: Vec<String>,
    images_across: usize,
    images_around: usize,
    length_m: f64,
    adjusted: ErrorRow,
    chained: ErrorRow,
}

#[derive(Serialize)]
struct ErrorRow {
    translation_mm: f64,
    rotation_deg: f64,
}

impl From<ClosureError> for ErrorRow {
    fn from(error: ClosureError) -> Self {
        Self { translation_mm: error.translation_m * 1e3, rotation_deg: error.rotation_rad.to_degrees() }
    }
}

fn names(tags: &[TagId]) -> Vec<String> {
    tags.iter().map(ToString::to_string).collect()
}

impl From<&MappedTag> for TagRow {
    fn from(tag: &MappedTag) -> Self {
        Self {
            family: tag.tag.family.name(),
            id: tag.tag.id,
            size_m: tag.size_m,
            size_std_m: tag.size_std_m,
            pose: tag.map_from_tag.into(),
            position_std_mm: tag.position_std_m().map(|std| std * 1e3),
            rotation_std_deg: tag.rotation_std_rad().map(f64::to_degrees),
            covariance: tag.covariance.transpose().into(),
            views: tag.views,
            rms_px: tag.rms_px,
        }
    }
}

impl Summary {
    /// Of a map of what was seen.
    pub fn new(args: &Args, name: &str, sights: &Sights, map: &TagMap) -> Self {
        let by_name = |values: &[f64]| {
            map.lens.param_names().iter().copied().zip(values.iter().copied()).collect::<BTreeMap<_, _>>()
        };
        let rejected = map.rejected.iter().map(|rejected| RejectedRow {
            image: rejected.view,
            tag: rejected.tag.to_string(),
            rms_px: rejected.rms_px.is_finite().then_some(rejected.rms_px),
        });
        let closure = map.closure.as_ref().map(|closure| ClosureRow {
            tags: names(&closure.tags),
            images_across: closure.views_across,
            images_around: closure.views_around,
            length_m: closure.length_m,
            adjusted: closure.adjusted.into(),
            chained: closure.chained.into(),
        });
        Self {
            input: name.to_owned(),
            output: args.output.clone(),
            origin: map.origin.to_string(),
            images: sights.images.len(),
            images_damaged: sights.damaged,
            images_with_tags: sights.images.iter().filter(|view| !view.observations.is_empty()).count(),
            images_used: map.views.iter().filter(|view| !view.tags.is_empty()).count(),
            tags: map.tags.iter().map(TagRow::from).collect(),
            views: view_rows(sights, map),
            rejected: rejected.collect(),
            unconnected: map.unconnected.iter().map(|group| names(group)).collect(),
            rms_px: map.rms_px,
            rms_mrad: map.rms_rad * 1e3,
            reduced_chi2: map.reduced_chi2,
            unexplained_px: map.unexplained_px,
            lens: LensRow {
                model: map.lens.kind().name(),
                params: by_name(&map.lens.params()),
                params_std: map.lens_std.as_deref().map(by_name),
            },
            closure,
            warnings: warnings(args, map),
        }
    }

    /// For people.
    pub fn text(&self) -> String {
        let mut out = format!(
            "{}: {} images, {} with tags, {} used; map of {} tags in the frame of {}\n",
            self.input,
            self.images,
            self.images_with_tags,
            self.images_used,
            self.tags.len(),
            self.origin
        );
        out += "  tag               size mm       x mm       y mm       z mm   ± mm   rx deg   ry deg   rz deg  ± deg views  rms px\n";
        for tag in &self.tags {
            let _ = writeln!(out, "  {}", tag.text());
        }
        let _ = writeln!(
            out,
            "  rms {:.3} px = {:.3} mrad; reduced χ² {:.2} with {:.3} px beside the corners' own errors",
            self.rms_px, self.rms_mrad, self.reduced_chi2, self.unexplained_px
        );
        if let Some(std) = &self.lens.params_std {
            let shown = self.lens.params.iter().map(|(name, value)| {
                format!("{name} {value:.4} ± {:.4}", std.get(name).copied().unwrap_or_default())
            });
            let _ = writeln!(
                out,
                "  lens estimated ({}): {}",
                self.lens.model,
                shown.collect::<Vec<_>>().join(", ")
            );
        }
        for rejected in &self.rejected {
            let by = rejected
                .rms_px
                .map_or("outside the field of view".to_owned(), |rms| format!("off by {rms:.2} px"));
            let _ = writeln!(out, "  left out: {} in image {}, {by}", rejected.tag, rejected.image);
        }
        match &self.closure {
            None => out += "  loop: none of four tags or more, or none whose cut leaves a way round\n",
            Some(closure) => out += &closure.text(),
        }
        let _ = writeln!(out, "written: {}", self.output.display());
        out
    }
}

impl TagRow {
    fn text(&self) -> String {
        let [x, y, z] = self.pose.position_m.map(|m| m * 1e3);
        let [rx, ry, rz] = self.pose.rotation_deg;
        let largest = |std: &[f64; 3]| std.iter().copied().fold(0.0, f64::max);
        format!(
            "{:<16} {:>8.2} {x:>10.2} {y:>10.2} {z:>10.2} {:>6.2} {rx:>8.2} {ry:>8.2} {rz:>8.2} {:>6.3} {:>5} {:>7.3}",
            format!("{} {}", self.family, self.id),
            self.size_m * 1e3,
            largest(&self.position_std_mm),
            largest(&self.rotation_std_deg),
            self.views,
            self.rms_px
        )
    }
}

impl ClosureRow {
    fn text(&self) -> String {
        let ends =
            |error: &ErrorRow| format!("{:.2} mm, {:.3} deg", error.translation_mm, error.rotation_deg);
        format!(
            "  loop of {} tags, {:.3} m long, cut between {} and {} ({} images across, {} around): fails to close by {}; before \
             adjustment by {}\n",
            self.tags.len(),
            self.length_m,
            self.tags.last().map_or("", String::as_str),
            self.tags.first().map_or("", String::as_str),
            self.images_across,
            self.images_around,
            ends(&self.adjusted),
            ends(&self.chained)
        )
    }
}

fn view_rows(sights: &Sights, map: &TagMap) -> Vec<ViewRow> {
    let row = |view: &coshade_tracker::map::View| {
        let mapped = map.views.iter().find(|mapped| mapped.number == view.number && !mapped.tags.is_empty());
        let seen: Vec<TagId> = view.observations.iter().map(|seen| seen.tag).collect();
        ViewRow {
            image: view.number,
            seen: names(&seen),
            used: mapped.map(|mapped| names(&mapped.tags)).unwrap_or_default(),
            rms_px: mapped.map(|mapped| mapped.rms_px),
            camera_from_map: mapped.map(|mapped| mapped.camera_from_map.into()),
        }
    };
    sights.images.iter().map(row).collect()
}

fn warnings(args: &Args, map: &TagMap) -> Vec<String> {
    let mut warnings = Vec::new();
    for group in &map.unconnected {
        warnings.push(format!(
            "not on the map, for no image shows any of them beside a tag that is: {}",
            names(group).join(", ")
        ));
    }
    for tag in map.tags.iter().filter(|tag| tag.views < 2) {
        warnings.push(format!("{} rests on {} view only", tag.tag, tag.views));
    }
    if map.unexplained_px > 0.5 && !args.refine_lens {
        warnings.push(format!(
            "corners are off by {:.2} px beside their own errors: the calibration does not fit, or tags are not flat; try \
             --refine-lens",
            map.unexplained_px
        ));
    }
    warnings
}
