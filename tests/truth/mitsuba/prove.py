#!/usr/bin/env python3
"""Proves where pictures lie: small glowing balls, traced by Mitsuba and warped as the truth cases are, are found within
0.02 px of where OpenCV projects them to; and the environment map is the one meant.

    DRJIT_LIBLLVM_PATH=…/libLLVM-19.so python tests/truth/mitsuba/prove.py

Exit code 1 if not.
"""

import sys
from pathlib import Path

import numpy as np

import tracing

VARIANT = tracing.choose_variant()

import mitsuba as mi  # noqa: E402  (needs the variant)

import lens as lenses  # noqa: E402
import scenes  # noqa: E402
import studio  # noqa: E402

TRUTH = Path(__file__).resolve().parents[1]
LARGEST_SHIFT_PX = 0.02
SAMPLES = 16
# Around a ball: how far, and in how many parts each pixel is divided along a side.
REACH_PX, PARTS = 5, 16


def unit_directions(lens, places):
    if isinstance(lens, lenses.Fisheye):
        return lens.directions(places)
    plane = lens.undistorted(places)
    directions = np.concatenate([plane, np.ones((*plane.shape[:-1], 1))], axis=-1)
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def expected_centroid(lens, direction, radius_rad):
    """Of the picture of a ball: which parts of the pixels around its centre's projection look at it. Differs from that
    projection by the curvature of the lens, and because a pixel tells only that light fell on it, not where."""
    centre = (lens.project_wide if isinstance(lens, lenses.Fisheye) else lens.project)(direction[None])[0]
    first = np.round(centre) - REACH_PX
    pixels = first + lenses.places([2 * REACH_PX + 1] * 2, PARTS)
    seen = unit_directions(lens, pixels) @ direction >= np.cos(radius_rad)
    return np.round(pixels[seen]).mean(axis=0)


def shifts(lens, places, radius_rad, world_from_camera):
    """Found minus expected centroids of balls around the places, pixels."""
    directions = unit_directions(lens, places)
    expected = np.array([expected_centroid(lens, direction, radius_rad) for direction in directions])
    scene = {"type": "scene", "integrator": {"type": "path", "max_depth": 1}}
    for i, direction in enumerate(directions):
        centre = world_from_camera[:3, :3] @ direction + world_from_camera[:3, 3]
        scene[f"ball_{i}"] = {"type": "sphere", "center": (tracing.UNITS * centre).tolist(),
                              "radius": float(tracing.UNITS * np.sin(radius_rad)),
                              "emitter": {"type": "area", "radiance": tracing.rgb([1, 1, 1])}}
    image = tracing.View(lens, world_from_camera).picture(mi.load_dict(scene), SAMPLES, seed=1)[..., 0]
    y, x = np.indices(image.shape)
    found = []
    for place in expected:
        near = image * (np.hypot(x - place[0], y - place[1]) < 2 * REACH_PX)
        found.append([(near * x).sum() / near.sum(), (near * y).sum() / near.sum()])
    return np.array(found) - expected


def grid(lens, step, radius_px=None):
    x, y = np.meshgrid(np.arange(16.3, lens.size[0] - 16, step), np.arange(16.7, lens.size[1] - 16, step))
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    if radius_px is None:
        return places
    return places[np.linalg.norm(places - lens.matrix[:2, 2], axis=1) < radius_px]


def balls():
    world_from_camera = scenes.looking([0.3, -0.2, 0.5], [1.0, 0.4, 0.3], roll_deg=11)
    good = True
    cases = [("camera", lenses.Camera(TRUTH / "camera_linear.toml"), 0.008),
             ("fisheye", lenses.Fisheye(TRUTH / "fisheye_linear.toml"), 0.03)]
    for name, lens, radius_rad in cases:
        places = grid(lens, 31.5, 112 if name == "fisheye" else None)
        vectors = shifts(lens, places, radius_rad, world_from_camera)
        distance = np.linalg.norm(vectors, axis=1)
        print(f"{name}: {len(places)} balls, largest shift {distance.max():.4f} px, mean "
              f"{vectors.mean(axis=0).round(4).tolist()} px")
        good &= bool(distance.max() <= LARGEST_SHIFT_PX)
    return good


def bilinear(image, direction):
    """The map by its definition: u = 1/2 - azimuth / 360°, v = polar angle / 180°, values at the texels' centres."""
    height, width, _ = image.shape
    x = (0.5 - np.arctan2(direction[1], direction[0]) / (2 * np.pi)) * width - 0.5
    y = np.arccos(direction[2]) / np.pi * height - 0.5
    x0, y0 = int(np.floor(x)), int(np.floor(y))
    row = [np.clip(y0 + i, 0, height - 1) for i in (0, 1)]
    upper, lower = (image[r, x0 % width] * (1 - (x - x0)) + image[r, (x0 + 1) % width] * (x - x0) for r in row)
    return upper * (1 - (y - y0)) + lower * (y - y0)


def environment():
    image = studio.texels()
    emitter = mi.load_dict(tracing.environment(image))
    directions = np.random.default_rng(1).normal(size=(20000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    interaction = mi.SurfaceInteraction3f()
    interaction.wi = -mi.Vector3f(directions.T.astype(np.float32))
    theirs = np.array(emitter.eval(interaction)).T
    ours = np.array([bilinear(image, direction) for direction in directions])
    worst = (np.abs(theirs - ours) / (ours + 0.05)).max()
    print(f"environment: largest relative difference {worst:.5f}")
    return bool(worst < 0.002)


if __name__ == "__main__":
    print(f"Mitsuba {mi.__version__}, {VARIANT}")
    sys.exit(0 if all([environment(), balls()]) else 1)
