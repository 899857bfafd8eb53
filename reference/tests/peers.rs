//! The committed pairs against the figures that scikit-image and flip-evaluator give for them
//! (`tests/peers/compare.py --write-json`).

use std::path::Path;

use coshade_reference::compare::{CompareArgs, run};

#[test]
fn figures_agree_with_the_peers() {
    let pairs = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/pairs");
    let pinned = std::fs::read_to_string(pairs.join("peers.json")).unwrap();
    let pinned: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&pinned).unwrap();
    assert_eq!(pinned.len(), 3);
    for (a, peer) in pinned {
        let b = peer["b"].as_str().unwrap();
        let path = |name: &str| pairs.join(name).to_string_lossy().into_owned();
        let report = run(&CompareArgs::new(path(&a), path(b))).unwrap();
        let ours = serde_json::to_value(&report).unwrap();
        // The peers' FLIP works in f32; a PSNR in dB magnifies relative errors by 8.7.
        for (figure, tolerance) in
            [("rmse_linear", 1e-6), ("psnr_db", 1e-5), ("ssim", 1e-6), ("flip_mean", 1e-5)]
        {
            let (ours, theirs) = (ours[figure].as_f64().unwrap(), peer[figure].as_f64().unwrap());
            assert!((ours - theirs).abs() < tolerance, "{a} {figure}: {ours} is not {theirs}");
        }
    }
}
