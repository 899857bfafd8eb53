"""Measures image pairs with `coshade compare` and with the peers it should agree with.

    pip install numpy scikit-image flip-evaluator imageio OpenEXR opencv-python-headless
    python tests/peers/compare.py target/debug/coshade            the committed pairs
    python tests/peers/compare.py target/debug/coshade A B [A B …]     pairs of yours (PNG, JPEG, EXR, HDR)
    python tests/peers/compare.py --write-json                    refresh the figures that `cargo test` pins

RMSE is of linear radiance clipped at 4 x white; PSNR (peak 1), SSIM and FLIP are of sRGB code values clipped to [0, 1],
as float: exactly what `coshade compare` documents. JPEG decoders differ by a code here and there, which can move a PSNR
by more than the bar. Exit status 1 if any figure differs by more than 1e-3.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import cv2
import flip_evaluator
import imageio.v3 as imageio
import numpy as np
import OpenEXR
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

REFERENCE = Path(__file__).parents[2] / "reference"
PAIRS = REFERENCE / "tests/data/pairs"
COMMITTED = [("noise_a.png", "noise_b.png"), ("blur_a.png", "blur_b.png"), ("hdr_a.exr", "hdr_b.exr")]
TOLERANCE = 1e-3
FIGURES = ["rmse_linear", "psnr_db", "ssim", "flip_mean"]


def encode(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)


def decode(code):
    return np.where(code <= 0.04045, code / 12.92, np.power((code + 0.055) / 1.055, 2.4))


def read_exr(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        names = "RGB" if "R" in channels else "Y"
        return np.stack([channels[name].pixels.astype(np.float64) for name in names], -1)


def read(path):
    """Linear radiance, height x width x channels, without alpha."""
    if path.suffix.lower() == ".exr":
        return read_exr(path)
    if path.suffix.lower() == ".hdr":
        return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., ::-1].astype(np.float64)
    pixels = imageio.imread(path)
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels[..., :3]
    if np.issubdtype(pixels.dtype, np.integer):
        return decode(pixels / np.iinfo(pixels.dtype).max)
    raise SystemExit(f"{path}: pixels of {pixels.dtype} are not read here")


def measure(path_a, path_b):
    a, b = read(path_a), read(path_b)
    shown_a, shown_b = encode(a), encode(b)
    colour = [np.repeat(s, 3, -1) if s.shape[-1] == 1 else s for s in (shown_a, shown_b)]
    flip = flip_evaluator.evaluate(*[c.astype(np.float32) for c in colour], "LDR", parameters={"ppd": 67.0})
    ssim = structural_similarity(
        shown_a, shown_b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1,
        channel_axis=-1,
    )
    return {
        "rmse_linear": float(np.sqrt(np.mean((np.minimum(a, 4) - np.minimum(b, 4)) ** 2))),
        "psnr_db": float(peak_signal_noise_ratio(shown_a, shown_b, data_range=1)),
        "ssim": float(ssim),
        "flip_mean": float(flip[1]),
    }


def ours(program, path_a, path_b):
    command = [program, "compare", str(path_a), str(path_b), "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def pin():
    figures = {a: {"b": b} | measure(PAIRS / a, PAIRS / b) for a, b in COMMITTED}
    (PAIRS / "peers.json").write_text(json.dumps(figures, indent=1) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?", help="the coshade binary, or the example `compare`")
    parser.add_argument("images", nargs="*", type=Path, help="A B A B …")
    parser.add_argument("--write-json", action="store_true", help="refresh the pinned figures and stop")
    arguments = parser.parse_args()
    if arguments.write_json:
        return pin()
    if not arguments.program or len(arguments.images) % 2:
        parser.error("give the program, and images in pairs")
    pairs = list(zip(arguments.images[::2], arguments.images[1::2]))
    pairs = pairs or [(PAIRS / a, PAIRS / b) for a, b in COMMITTED]

    worst = 0.0
    print(f"{'pair':<36} {'figure':<12} {'coshade':>12} {'peer':>12} {'difference':>11}")
    for a, b in pairs:
        report, peer = ours(arguments.program, a, b), measure(a, b)
        for figure in FIGURES:
            difference = abs(report[figure] - peer[figure])
            worst = max(worst, difference)
            name = f"{a.name} {b.name}"
            print(f"{name:<36} {figure:<12} {report[figure]:12.6f} {peer[figure]:12.6f} {difference:11.1e}")
    print(f"largest difference {worst:.1e} (bar {TOLERANCE})")
    return 0 if worst <= TOLERANCE else 1


if __name__ == "__main__":
    sys.exit(main())
