#!/usr/bin/env python3
"""Holds the truth cases made by make.py against what coshade's own path tracer makes of their world files.

    venv/bin/python tests/truth/mitsuba/check.py --work FOLDER [--coshade target/debug/coshade] [case …]

FOLDER is that of make.py. coshade traces SEEDS pictures; sigma is the standard error of the mean of a block of 16 x 16
pixels, of both programs together. A picture passes if |difference| <= 4 sigma in at least 99.5 % of all blocks and
colours, and if the means of the whole pictures differ by at most 0.3 % (of the mean of `real`, for the difference of the
worlds). Where light is looked at directly sigma is nearly 0, so two things are allowed beside it: what a shift by 1/64
pinhole pixel makes in the block, because cv2.remap rounds positions to 1/32, and a millionth of the radiance. Pixels that
the fish-eye's image circle cuts do not count. Surfaces pass if depth, normal, albedo and coverage differ by no more than
stated below. Needs numpy, opencv-python-headless and OpenEXR. Exit code 1 if anything fails.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

import lens as lenses
import picture
from estimate import Estimate, blocks

TRUTH = Path(__file__).resolve().parents[1]
CASES = ("1_shadow", "6_near_light")
SEEDS, SAMPLES = 16, 48
SIGMAS, SHARE, MEAN = 4.0, 0.995, 0.003
# Of means of blocks of coverage, albedo and normal: 4 sigma of a block that an edge of contrast 1 crosses (16 pixels of 768
# samples: 4 √16 / (2 √768) / 256 = 0.0011), and what the blur of `lens.py` carries across a block's border (0.0045 of 16
# pixels: 0.0003). An edge that is 0.025 px off fails.
# Of depth, relative, where a pixel shows one surface: samples lie 0.29 px (root mean square) beside its centre, which at 75°
# off the normal and 300 px is 0.0036; their mean 0.00013, 4 sigma 0.0005.
LARGEST_LAYER, LARGEST_DEPTH = 0.0014, 0.0005
DEPTH_UNIT_M = 0.0001
# Of a pinhole pixel; and pinhole pixels per pixel of the camera and of the fish-eye.
ROUNDING = 1 / 64
# Of a radiance, in sums of 32-bit floats.
FLOATS = 1e-6
CAMERA_DENSITY, FISHEYE_DENSITY = lenses.DENSITY, 4
LAYERS = {"coverage": "Y", "albedo": "RGB", "normal": "XYZ"}


class Ours:
    """Pictures of one sensor; pixels count as `weights` says."""

    def __init__(self, coshade, world, sensor, names, weights=1.0):
        self.estimates = {name: Estimate() for name in names}
        self.layers = {}
        with tempfile.TemporaryDirectory() as folder:
            for seed in range(SEEDS):
                path = Path(folder) / "traced.exr"
                subprocess.run([coshade, "reference", f"{world}#{sensor}", "-o", path, "--samples", str(SAMPLES),
                                "--seed", str(seed)], check=True, stdout=subprocess.DEVNULL)
                for name in names:
                    self.estimates[name].add(picture.read_exr(path, name, "RGB") * weights)
                if sensor == "camera":
                    for name, channels in {**LAYERS, "depth_z_m": "Z"}.items():
                        one = picture.read_exr(path, name, channels) / SEEDS
                        self.layers[name] = self.layers.get(name, 0) + one


def gradient(image):
    """Sum of the absolute slopes along x and y, per pixel."""
    return sum(np.abs(cv2.Sobel(image, cv2.CV_64F, *axes)) / 8 for axes in ((1, 0), (0, 1)))


def compare(title, ours, theirs, name, scale, weights, density):
    counts = blocks(weights)[..., 0] > 0.25
    difference = (blocks(ours.mean) - blocks(theirs[f"{name}_mean"] * weights))[counts]
    sigma = np.hypot(ours.block_error, theirs[f"{name}_block_error"])[counts]
    rounding = ROUNDING / density * blocks(gradient(theirs[f"{name}_mean"] * weights))[counts]
    rounding += FLOATS * blocks(theirs[f"{name}_mean"])[counts]
    in_sigmas = np.maximum(np.abs(difference) - rounding, 0) / np.maximum(sigma, 1e-9)
    within = (in_sigmas <= SIGMAS).mean()
    mean = difference.mean() / scale
    mean_sigma = np.hypot(ours.whole_error, theirs[f"{name}_whole_error"]) / scale
    good = within >= SHARE and abs(mean) <= MEAN
    print(f"{title:24} {100 * within:7.2f} % within 4 sigma, worst {in_sigmas.max():5.2f}; mean {100 * mean:+.3f} "
          f"± {100 * mean_sigma:.3f} %; sigma of a block {100 * np.median(sigma) / scale:.3f} %  "
          f"{'ok' if good else 'FAILED'}", flush=True)
    return good


def compare_surfaces(case, layers):
    path, good = TRUTH / case / "truth.exr", True
    for name, channels in LAYERS.items():
        worst = np.abs(blocks(layers[name]) - blocks(picture.read_exr(path, name, channels))).max()
        good &= bool(worst <= LARGEST_LAYER)
        print(f"{case + ' ' + name:24} largest difference of a block {worst:.5f}")
    ours, theirs = layers["depth_z_m"][..., 0], picture.read_exr(path, "depth_z_m", "Z")[..., 0]
    smooth = one_surface(theirs) & one_surface(ours)
    worst = np.abs(ours / np.maximum(theirs, 1e-9) - 1)[smooth].max()
    print(f"{case + ' depth_z_m':24} largest relative difference {worst:.6f} in {smooth.mean():.0%} of the pixels")
    good &= bool(worst <= LARGEST_DEPTH) and smooth.mean() > 0.5
    # Real things at pixel centres: where nothing virtual is in front.
    centre = cv2.imread(str(TRUTH / case / "depth.png"), cv2.IMREAD_UNCHANGED) * DEPTH_UNIT_M
    both = smooth & one_surface(centre) & (layers["coverage"][..., 0] == 0)
    worst = (np.abs(centre - ours) - DEPTH_UNIT_M / 2)[both].max()
    print(f"{case + ' depth.png':24} largest difference {1000 * worst:.3f} mm beyond rounding in {both.mean():.0%}")
    return good and bool(worst <= LARGEST_DEPTH) and both.mean() > 0.5


def one_surface(depth):
    """True where depth is nearly linear over the neighbourhood."""
    curvature = np.abs(cv2.Laplacian(depth, cv2.CV_64F))
    near = cv2.dilate(curvature, np.ones((3, 3)))
    return (depth > 0) & (near < 0.002 * depth)


def inside_circle():
    """1 for pixels that the image circle does not cut, else 0."""
    fisheye = lenses.Fisheye(TRUTH / "fisheye_linear.toml")
    whole = fisheye.warp([np.ones((*pinhole.size[::-1], 3)) for pinhole in fisheye.pinholes])
    return whole[..., :1] > 0.9999


def check(case, args):
    theirs = np.load(args.work / f"{case}.npz")
    world = TRUTH / case / "world.toml"
    scale = theirs["real_mean"].mean()
    camera = Ours(args.coshade, world, "camera", ("real", "mixed", "difference"))
    good = True
    for name, ours in camera.estimates.items():
        everywhere = np.ones((*ours.mean.shape[:2], 1))
        good &= compare(f"{case} camera {name}", ours, theirs, name, scale, everywhere, CAMERA_DENSITY)
    good &= compare_surfaces(case, camera.layers)
    inside = inside_circle()
    fisheye = Ours(args.coshade, world, "fisheye", ("real",), inside).estimates["real"]
    good &= compare(f"{case} fisheye", fisheye, theirs, "fisheye", fisheye.mean.mean(), inside, FISHEYE_DENSITY)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="case", help=f"{', '.join(CASES)}; both if none is given")
    parser.add_argument("--work", type=Path, default=Path("target/truth"), help="where make.py left its means")
    parser.add_argument("--coshade", default=str(TRUTH.parents[1] / "target" / "debug" / "coshade"))
    args = parser.parse_args()
    unknown = set(args.cases) - set(CASES)
    if unknown:
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    for case in args.cases or CASES:
        if not (args.work / f"{case}.npz").is_file():
            sys.exit(f"error: {args.work / f'{case}.npz'} does not exist: run make.py with the same --work")
    return 0 if all([check(case, args) for case in args.cases or CASES]) else 1


if __name__ == "__main__":
    sys.exit(main())
