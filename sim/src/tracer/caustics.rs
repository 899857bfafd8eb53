//! Light that mirrors and glass throw: photon maps of a world that stands still, traced once and shared by all pictures.

use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

use coshade_reference::integrator::{Settings, TraceScene};
use coshade_reference::photon::{PhotonMap, PhotonPaths, RadiusSchedule, trace_photons};
use rayon::prelude::*;

/// At most so many maps: they and the radii make what is left of noise and blur in a caustic.
const MOST_MAPS: u32 = 64;
/// About so many photons are to be kept in a map. One takes some 70 bytes: 2.3 MB a map, 150 MB for all.
const WANTED: u32 = 1 << 15;
/// No more start for a map, however few meet anything specular.
const MOST_PHOTONS: u32 = 1 << 18;
/// These start first, to see how many of them would be kept.
const PILOTS: u32 = 1 << 12;
/// Radius of the first map by that of the scene.
const RADIUS_SHARE: f32 = 1.0 / 300.0;

/// Photon maps for the samples of a pixel.
///
/// Sample s gathers from map s mod n, so that the mean over a pixel's samples is that of progressive photon mapping
/// ([`coshade_reference::photon`]) with n passes. The maps depend on nothing but the scene.
pub struct Caustics {
    count: u32,
    maps: OnceLock<Vec<PhotonMap>>,
}

impl Caustics {
    /// For pictures of so many samples a pixel; none where nothing is specular or no lamp shines.
    pub fn new(scene: &TraceScene, samples: u32) -> Self {
        let count = if scene.may_have_lamp_caustics() { samples.min(MOST_MAPS) } else { 0 };
        Self { count, maps: OnceLock::new() }
    }

    /// The maps; the first call traces them.
    pub fn maps(&self, scene: &TraceScene, settings: &Settings) -> &[PhotonMap] {
        if self.count == 0 {
            return &[];
        }
        self.maps.get_or_init(|| on_own_threads(|| trace(scene, settings, self.count)))
    }
}

/// The map for a sample.
pub fn of_sample(maps: &[PhotonMap], sample: u32) -> Option<&PhotonMap> {
    maps.get(sample as usize % maps.len().max(1))
}

fn trace(scene: &TraceScene, settings: &Settings, count: u32) -> Vec<PhotonMap> {
    let radius = RadiusSchedule::new(scene.radius_m() * RADIUS_SHARE);
    let stop = AtomicBool::new(false);
    let photons =
        |count, pass| trace_photons(scene, settings, PhotonPaths::Caustics, count, [0, pass], &stop);
    // A pass that no map has.
    let kept = photons(PILOTS, MOST_MAPS).map_or(0, |kept| kept.len());
    let started = started(kept);
    (0..count)
        .into_par_iter()
        .filter_map(|pass| Some(PhotonMap::new(&photons(started, pass)?, radius.radius_m(pass))))
        .collect()
}

/// How many photons must start for a map, if `kept` of the pilots would be kept.
fn started(kept: usize) -> u32 {
    let wanted = u64::from(WANTED) * u64::from(PILOTS) / (kept as u64).max(1);
    wanted.clamp(u64::from(PILOTS), u64::from(MOST_PHOTONS)) as u32
}

/// Runs `work` on threads of its own while the caller waits: a thread of the common pool would meanwhile take up other
/// pictures, which wait for these very maps.
fn on_own_threads<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().build() {
        Ok(pool) => std::thread::scope(|scope| match scope.spawn(|| pool.install(work)).join() {
            Ok(done) => done,
            Err(panic) => std::panic::resume_unwind(panic),
        }),
        Err(error) => {
            tracing::warn!("no threads for photons ({error}): they share those of the pictures");
            work()
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use coshade_scene::light::Rectangle;
    use coshade_scene::{Light, LightKind, Material, Pose, Scene, Similarity, Thing, World};
    use glam::{Vec2, Vec3};

    use super::*;

    fn scene(material: Material, has_lamp: bool) -> TraceScene {
        let thing = Thing {
            name: "plate".into(),
            world: World::Real,
            mesh: Arc::new(coshade_scene::shape::plane(Vec2::ONE).unwrap()),
            materials: vec![Arc::new(material)],
            pose: Pose::World(Similarity::IDENTITY),
            hide_marker: false,
        };
        let lamp = Light {
            name: "lamp".into(),
            world: World::Real,
            pose: Pose::World(Similarity::from_translation(Vec3::NEG_Z)),
            kind: LightKind::Rectangle(Rectangle { size_m: Vec2::ONE, radiance: Vec3::ONE }),
        };
        let lights = if has_lamp { vec![lamp] } else { Vec::new() };
        TraceScene::build(&Scene { things: vec![thing], lights }, None, |_| None).unwrap()
    }

    #[test]
    fn there_are_maps_only_where_lamps_meet_something_specular() {
        let mirror = || Material::metal(Vec3::ONE, 0.0);
        for (material, has_lamp, count) in
            [(Material::diffuse(Vec3::ONE), true, 0), (mirror(), false, 0), (mirror(), true, 3)]
        {
            let scene = scene(material, has_lamp);
            let caustics = Caustics::new(&scene, 3);
            let maps = caustics.maps(&scene, &Settings::default());
            assert_eq!(maps.len(), count);
            assert!(of_sample(maps, 7).is_some() == (count > 0));
        }
        assert_eq!(Caustics::new(&scene(mirror(), true), 1000).count, MOST_MAPS);
    }

    #[test]
    fn photons_are_bounded() {
        assert_eq!(started(0), MOST_PHOTONS);
        assert_eq!(started(PILOTS as usize / 2), 2 * WANTED);
        assert_eq!(started(usize::MAX), PILOTS);
    }
}
