#!/usr/bin/env python3
"""Renders sessions with `coshade reference` and with Mitsuba 3, and holds the pictures against each other.

    python -m venv venv && venv/bin/pip install 'mitsuba==3.*'
    venv/bin/python tests/peers/mitsuba.py [--coshade target/debug/coshade] [--pictures FOLDER] [case …]

`llvm_ad_rgb` is used where LLVM is found (Debian: libllvm19, DRJIT_LIBLLVM_PATH=…/libLLVM-19.so), else `scalar_rgb`.
Every picture is rendered with SEEDS independent seeds; sigma is the standard error of a block's mean over the seeds, of
both programs together.

A case passes if |difference| <= 4 sigma in at least 99.5 % of all 16x16 blocks and colours, and if the means of the whole
pictures differ by at most 0.3 %. The edges of the glowing box have to lie within 0.02 px of each other. Exit code 1 if a
case fails.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
# This file would be found in place of the package of the same name.
sys.path = [folder for folder in sys.path if Path(folder or ".").resolve() != HERE]

try:
    import mitsuba as mi
    import numpy as np
except ImportError:
    print("skipped: mitsuba.py: Mitsuba is not installed (pip install mitsuba)")
    sys.exit(0)

SEEDS = 16
BLOCK = 16
SIGMAS, SHARE, MEAN, EDGE_PX = 4.0, 0.995, 0.003, 0.02
# Samples a pixel and seed: (coshade, Mitsuba).
CASES = {"cornell": (48, 128), "metal": (48, 128), "glass": (48, 512)}
EDGE_SAMPLES = 1024


def choose_variant():
    for variant in ("llvm_ad_rgb", "scalar_rgb"):
        try:
            mi.set_variant(variant)
            return variant
        except ImportError as error:
            print(f"{variant} is not available: {error}", file=sys.stderr)
    sys.exit("error: no variant of Mitsuba can be used")


def children_cpu_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def coshade(binary, *arguments):
    subprocess.run([binary, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def read_layers(path, names):
    """Layers of an EXR as float64 arrays of shape (height, width, 3)."""
    bitmap = mi.Bitmap(str(path))
    data = np.array(bitmap, dtype=np.float64)
    columns = {field.name: i for i, field in enumerate(bitmap.struct_())}
    return [data[..., [columns[f"{name}.{channel}"] for channel in "RGB"]] for name in names]


def render_ours(binary, session, samples, seeds, folder):
    """({world: array (seed, height, width, 3)}, CPU seconds of one seed)."""
    worlds = {"real": [], "mixed": []}
    begun = children_cpu_s()
    for seed in range(seeds):
        path = folder / f"{seed}.exr"
        coshade(binary, "reference", session, "-o", path, "--samples", samples, "--seed", seed)
        for world, image in zip(worlds, read_layers(path, worlds)):
            worlds[world].append(image)
    return {world: np.array(images) for world, images in worlds.items()}, (children_cpu_s() - begun) / seeds


def render_theirs(binary, session, world, samples, seeds, folder):
    """(array (seed, height, width, 3), CPU seconds of one seed)."""
    path = folder / world / "scene.xml"
    coshade(binary, "export", session, "--mitsuba", path, "--world", world, "--exact")
    scene = mi.load_file(str(path), spp=samples)
    # Kernels are compiled at the first call.
    np.array(mi.render(scene, spp=samples, seed=10**6))
    begun = time.process_time()
    images = [np.array(mi.render(scene, spp=samples, seed=seed), dtype=np.float64) for seed in range(seeds)]
    return np.array(images), (time.process_time() - begun) / seeds


def blocks(images):
    """Means of blocks, (seed, rows, columns, 3); what is left over at the right and bottom makes smaller blocks."""
    height, width = images.shape[1:3]
    rows, columns = range(0, height, BLOCK), range(0, width, BLOCK)
    return np.stack([np.stack([images[:, y:y + BLOCK, x:x + BLOCK].mean(axis=(1, 2)) for x in columns], axis=1)
                     for y in rows], axis=1)


def standard_error2(samples):
    return samples.var(axis=0, ddof=1) / len(samples)


def compare(ours, theirs):
    ours_blocks, theirs_blocks = blocks(ours), blocks(theirs)
    difference = ours_blocks.mean(axis=0) - theirs_blocks.mean(axis=0)
    sigma = np.sqrt(standard_error2(ours_blocks) + standard_error2(theirs_blocks))
    # A block that is black in both has no sigma, and no difference.
    in_sigmas = np.abs(difference) / np.maximum(sigma, 1e-12)
    whole = [images.mean(axis=(1, 2, 3)) for images in (ours, theirs)]
    reference = whole[1].mean()
    return {
        "within": (in_sigmas <= SIGMAS).mean(),
        "worst_sigmas": in_sigmas.max(),
        "worst_block": tuple(int(i) for i in np.unravel_index(in_sigmas.argmax(), in_sigmas.shape)),
        "mean": whole[0].mean() / reference - 1,
        "mean_sigma": np.sqrt(sum(standard_error2(means) for means in whole)) / reference,
        "block_sigma": float(np.median(sigma / np.maximum(theirs_blocks.mean(axis=0), 1e-12))),
    }


def error2_times_cpu(images, cpu_s):
    """Variance of a pixel, relative to the mean squared, times CPU seconds: half of it is half the time to equal error."""
    return images.var(axis=0, ddof=1).mean() / images.mean() ** 2 * cpu_s


def write_picture(path, image):
    picture = mi.Bitmap(np.ascontiguousarray(image, dtype=np.float32))
    picture.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True).write(str(path))


def run_case(name, args, folder):
    session = HERE / "mitsuba" / f"{name}.toml"
    ours, cpu_ours = render_ours(args.coshade, session, CASES[name][0], SEEDS, folder)
    passed = True
    for world in ("real", "mixed"):
        theirs, cpu_theirs = render_theirs(args.coshade, session, world, CASES[name][1], SEEDS, folder)
        figures = compare(ours[world], theirs)
        good = figures["within"] >= SHARE and abs(figures["mean"]) <= MEAN
        passed &= good
        cost = (error2_times_cpu(ours[world], cpu_ours), error2_times_cpu(theirs, cpu_theirs))
        print(f"{name:8} {world:6} {100 * figures['within']:8.2f} {figures['worst_sigmas']:7.2f} "
              f"{str(figures['worst_block']):>11} {100 * figures['mean']:8.3f} ± {100 * figures['mean_sigma']:.3f} "
              f"{100 * figures['block_sigma']:10.3f} {cost[0]:10.3g} {cost[1]:10.3g}  {'ok' if good else 'FAILED'}",
              flush=True)
        if args.pictures:
            both = [ours[world].mean(axis=0), theirs.mean(axis=0)]
            scale = 0.8 / np.quantile(both[1], 0.98)
            signed = 0.5 + 10 * scale * (both[0] - both[1])
            write_picture(args.pictures / f"{name}_{world}.png", np.hstack([both[0] * scale, both[1] * scale, signed]))
    return passed


def edge_positions(image, middle):
    """x of the left and right edge of a glowing convex shape in the rows that it covers at column `middle`."""
    rows = np.flatnonzero(image[:, middle] > 0.999)
    return rows, np.array([middle - image[rows, :middle].sum(axis=1), middle + image[rows, middle:].sum(axis=1)])


def largest_shift(image, other):
    """Largest shift of an edge after a quadratic fit over its rows, which takes the noise away, in pixels."""
    middle = int(round((image.sum(axis=0) * np.arange(image.shape[1])).sum() / image.sum()))
    (rows, ours), (rows_other, theirs) = edge_positions(image, middle), edge_positions(other, middle)
    common, i, j = np.intersect1d(rows, rows_other, return_indices=True)
    if len(common) < 20:
        return float("inf")
    return max(np.abs(np.polyval(np.polyfit(common, d, 2), common)).max() for d in ours[:, i] - theirs[:, j])


def run_edges(args, folder):
    session = HERE / "mitsuba" / "edges.toml"
    ours, _ = render_ours(args.coshade, session, EDGE_SAMPLES, 1, folder)
    theirs, _ = render_theirs(args.coshade, session, "real", 4 * EDGE_SAMPLES, 1, folder)
    ours, theirs = ours["real"][0, ..., 0], theirs[0, ..., 0]
    shifts = (largest_shift(ours, theirs), largest_shift(ours.T, theirs.T))
    good = max(shifts) <= EDGE_PX
    print(f"edges: left and right {shifts[0]:.4f} px, upper and lower {shifts[1]:.4f} px  {'ok' if good else 'FAILED'}")
    if args.pictures:
        gray = np.hstack([ours, theirs, 0.5 + (ours - theirs)])
        write_picture(args.pictures / "edges.png", np.repeat(gray[..., None], 3, axis=2) * 0.8)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="case", help=f"edges, {', '.join(CASES)}; all if none is given")
    parser.add_argument("--coshade", default=str(HERE.parents[1] / "target" / "debug" / "coshade"))
    parser.add_argument("--pictures", type=Path, help="write ours | Mitsuba's | 0.5 + 10 x difference here")
    args = parser.parse_args()
    unknown = set(args.cases) - {"edges", *CASES}
    if unknown:
        parser.error(f"no such case: {', '.join(sorted(unknown))}")
    if not Path(args.coshade).is_file():
        sys.exit(f"error: {args.coshade} does not exist: build it with `cargo build -p coshade`, or give --coshade")
    if args.pictures:
        args.pictures.mkdir(parents=True, exist_ok=True)
    print(f"Mitsuba {mi.__version__}, {choose_variant()}, {os.cpu_count()} processors")
    wanted = args.cases or ["edges", *CASES]
    passed = True
    with tempfile.TemporaryDirectory() as folder:
        if "edges" in wanted:
            passed &= run_edges(args, Path(folder))
        print(f"{'case':8} {'world':6} {'% <= 4 s':>8} {'worst s':>7} {'y x colour':>11} {'mean, %':>16} "
              f"{'sigma, %':>10} {'ours':>10} {'Mitsuba':>10}  (relative error² x CPU s)")
        for name in CASES:
            if name in wanted:
                passed &= run_case(name, args, Path(folder))
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
