//! A name for a job, by which its shards are known.

use crate::camera::Camera;
use crate::film::ShardMark;
use crate::integrator::TraceScene;
use crate::random::hash_words;

use super::{JobOptions, Shard};

/// Hash of all triangles, what they belong to, lamps' powers, camera and options (but for shard, threads and limits).
/// Textures and environment are not looked at.
pub(super) fn of_job(scene: &TraceScene, camera: &Camera, options: &JobOptions) -> u64 {
    let comparable = JobOptions {
        shard: Shard::default(),
        threads: 0,
        time_limit: None,
        error_limit: None,
        samples: 0,
        ..options.clone()
    };
    let mut hash = [1, 2];
    let mut mix = |words: &[u32]| {
        for half in &mut hash {
            *half = hash_words(&[*half, hash_words(words)]);
        }
    };
    let geometry = scene.accel().geometry();
    for triangle in 0..geometry.triangle_count() {
        let corners = geometry.corners(triangle).map(|corner| corner.to_array().map(f32::to_bits));
        mix(corners.as_flattened());
        let place = geometry.triangle(triangle);
        mix(&[place.thing, place.material, u32::from(geometry.is_real(triangle))]);
    }
    mix(&[scene.lights().len() as u32]);
    let text = format!("{camera:?} {comparable:?}");
    mix(&text.bytes().map(u32::from).collect::<Vec<_>>());
    let [low, high] = hash.map(u64::from);
    ShardMark::key_of(low | high << 32)
}
