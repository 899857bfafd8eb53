#!/usr/bin/env python3
"""Makes the two truth cases that do not come from coshade: traced by Mitsuba 3, brought into the lenses by OpenCV.

    python -m venv venv && venv/bin/pip install 'mitsuba==3.*' 'opencv-python-headless==5.*' 'OpenEXR==3.*' numpy
    DRJIT_LIBLLVM_PATH=…/libLLVM-19.so venv/bin/python tests/truth/mitsuba/make.py [--work FOLDER] [case …]

Python 3.11 or newer. Writes camera.exr, fisheye.exr, depth.png, truth.exr and truth.json of each case, and studio.exr. In
FOLDER it leaves means and standard errors in full precision for check.py. See README.md.
"""

import argparse
import json
import time
from pathlib import Path

import cv2
import numpy as np

import tracing

VARIANT = tracing.choose_variant()

import mitsuba as mi  # noqa: E402  (needs the variant)

import lens as lenses  # noqa: E402
import picture  # noqa: E402
import scenes  # noqa: E402
import studio  # noqa: E402
from estimate import Estimate, rms  # noqa: E402

TRUTH = Path(__file__).resolve().parents[1]
# Of the pinhole pictures, a pixel and batch.
SAMPLES = 4
FISHEYE_BATCHES, SURFACE_BATCHES = 24, 8
FEWEST_BATCHES, MOST_BATCHES = 28, 96
# Standard error of the difference, as a share of the difference (root mean squares where nothing virtual is seen). Asked
# for is 1/20.
NOISE = 1 / 25
# Radiance counts up to here.
CLIP = 4.0
DEPTH_UNIT_M = 0.0001


def both_worlds(case, view, coverage):
    """Both worlds are traced with the same random numbers, so that what they share cancels."""
    real, mixed = (tracing.light_scene(case, mixed) for mixed in (False, True))
    estimates = {name: Estimate() for name in ("real", "mixed", "difference", "clipped")}
    while not done(estimates["clipped"], coverage):
        seed = estimates["real"].count
        images = [view.picture(scene, SAMPLES, seed) for scene in (real, mixed)]
        clipped = [np.minimum(image, CLIP) for image in images]
        for name, image in zip(estimates, [*images, images[1] - images[0], clipped[1] - clipped[0]]):
            estimates[name].add(image)
        print(f"  batch {seed}: noise {noise(estimates['clipped'], coverage):.4f}", flush=True)
    return estimates


def noise(clipped, coverage):
    untouched = coverage == 0
    if clipped.count < 2:
        return np.inf
    return rms(clipped.error[untouched]) / rms(clipped.mean[untouched])


def done(clipped, coverage):
    enough = clipped.count >= FEWEST_BATCHES and noise(clipped, coverage) <= NOISE
    return enough or clipped.count >= MOST_BATCHES


def surfaces(case, view):
    """Layers of the first surface of the mixed world, all of the same samples."""
    masks, aovs = (sum(view.picture(scene, SAMPLES, 5000 + i) for i in range(SURFACE_BATCHES)) / SURFACE_BATCHES
                   for scene in (tracing.mask_scene(case), tracing.surface_scene(case)))
    # Sums of bilinear weights are not quite 1.
    masks = np.round(masks, 6)
    return {"coverage": masks[..., 0:1], "hit": masks[..., 1], "position": aovs[..., 0:3] / tracing.UNITS,
            "normal": aovs[..., 3:6], "albedo": aovs[..., 6:9]}


def mean_depth(layers, world_from_camera):
    """z of what is hit: positions count 0 where nothing is."""
    forward, centre = world_from_camera[:3, 2], world_from_camera[:3, 3]
    hit = layers["hit"]
    depth = (layers["position"] @ forward - hit * (centre @ forward)) / np.maximum(hit, 1e-9)
    return np.where(hit > 1e-3, depth, 0)


def fisheye_picture(case, view):
    estimate, scene = Estimate(), tracing.light_scene(case, mixed=False)
    for batch in range(FISHEYE_BATCHES):
        estimate.add(view.picture(scene, SAMPLES, 1000 + batch))
    return estimate


def figures(estimates, coverage, view, seconds):
    untouched = coverage == 0
    clipped = estimates["clipped"]
    error, difference = rms(clipped.error[untouched]), rms(clipped.mean[untouched])
    virtual = coverage == 1
    return {
        "mitsuba": mi.__version__, "variant": VARIANT, "opencv": cv2.__version__,
        "camera_seeds": clipped.count, "fisheye_seeds": FISHEYE_BATCHES,
        "samples_per_pinhole_pixel_and_seed": SAMPLES,
        "pinhole_size_px": [int(side) for side in view.lens.pinhole.size],
        "pinhole_pixels_per_camera_pixel": lenses.DENSITY ** 2, "parts_per_camera_pixel": lenses.PARTS ** 2,
        "max_scattering_events": tracing.MAX_SEGMENTS - 1,
        "pixels_real": int(untouched.sum()), "pixels_virtual": int(virtual.sum()),
        "pixels_edge": int((~untouched & ~virtual).sum()),
        "difference_real_rms": difference, "difference_real_standard_error_rms": error,
        "noise": error / difference, "seconds": round(seconds),
    }


def make(name, work):
    print(name, flush=True)
    begun = time.monotonic()
    case, folder = scenes.CASES[name](), TRUTH / name
    camera, fisheye = (lenses.Camera(TRUTH / "camera_linear.toml"), lenses.Fisheye(TRUTH / "fisheye_linear.toml"))
    view = tracing.View(camera, case.camera)
    layers = surfaces(case, view)
    coverage = layers["coverage"][..., 0]
    estimates = both_worlds(case, view, coverage)
    around = fisheye_picture(case, tracing.View(fisheye, case.fisheye))
    depth = tracing.depth_at_centres(case, camera, case.camera)
    folder.mkdir(exist_ok=True)
    picture.write_exr(folder / "camera.exr", {"": ("RGB", estimates["real"].mean)})
    picture.write_exr(folder / "fisheye.exr", {"": ("RGB", around.mean)})
    picture.write_exr(folder / "truth.exr", {
        "mixed": ("RGB", estimates["mixed"].mean),
        "difference": ("RGB", estimates["difference"].mean),
        "difference_error": ("RGB", picture.rounded_error(estimates["difference"].error)),
        "coverage": ("Y", layers["coverage"]),
        "depth_z_m": ("Z", picture.rounded_depth(mean_depth(layers, case.camera))),
        "normal": ("XYZ", layers["normal"]),
        "albedo": ("RGB", layers["albedo"]),
    })
    picture.write_depth(folder / "depth.png", depth, DEPTH_UNIT_M)
    facts = figures(estimates, coverage, view, time.monotonic() - begun)
    (folder / "truth.json").write_text(json.dumps(facts, indent=2) + "\n")
    print(json.dumps(facts), flush=True)
    arrays = {"coverage": coverage, "depth": depth, **around.arrays("fisheye")}
    for kind in ("real", "mixed", "difference"):
        arrays |= estimates[kind].arrays(kind)
    work.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(work / f"{name}.npz", **arrays)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="case", help=f"{', '.join(scenes.CASES)}; both if none is given")
    parser.add_argument("--work", type=Path, default=Path("target/truth"), help="for what check.py needs")
    args = parser.parse_args()
    unknown = set(args.cases) - set(scenes.CASES)
    if unknown:
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    picture.write_exr(TRUTH / "studio.exr", {"": ("RGB", studio.texels())})
    for name in args.cases or scenes.CASES:
        make(name, args.work)


if __name__ == "__main__":
    main()
