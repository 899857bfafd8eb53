"""Makes the three pairs of images that figures are compared on, and a coverage layer for the third.

    python make_pairs.py            (numpy, scipy, imageio, OpenEXR)

noise  colour PNG, 8 bit, 128x96:   B has Gaussian noise of 4 % added
blur   colour PNG, 8 bit, 181x135:  B is blurred with a sigma of 1.2 px
hdr    EXR, half, 144x104:          highlights up to 30 x white; B is moved by (2, 1) px and 10 % brighter
"""

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import OpenEXR
from scipy.ndimage import gaussian_filter

HERE = Path(__file__).parent / "pairs"


def scene(width, height, rng):
    """Linear RGB: a gradient, tiles, discs of saturated colour, fine stripes."""
    y, x = np.mgrid[0:height, 0:width]
    image = np.stack([0.1 + 0.5 * x / width, 0.1 + 0.4 * y / height, np.full((height, width), 0.25)], -1)
    image[((x // 12 + y // 12) % 2 == 0) & (y > height // 2)] *= 0.35
    image[(x // 2 % 2 == 0) & (y < height // 5)] *= 0.6
    for _ in range(9):
        centre, radius = rng.uniform([0, 0], [width, height]), rng.uniform(4, height / 6)
        image[np.hypot(x - centre[0], y - centre[1]) < radius] = rng.uniform(0.02, 0.9, 3)
    return image


def srgb(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def write_png(name, linear):
    imageio.imwrite(HERE / name, np.round(255 * srgb(linear)).astype(np.uint8))


def write_exr(name, channels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(str(HERE / name))


def main():
    rng = np.random.default_rng(20)
    HERE.mkdir(exist_ok=True)

    image = scene(128, 96, rng)
    write_png("noise_a.png", image)
    write_png("noise_b.png", image + rng.normal(0, 0.04, image.shape))

    image = scene(181, 135, rng)
    write_png("blur_a.png", image)
    write_png("blur_b.png", gaussian_filter(image, (1.2, 1.2, 0)))

    image = scene(160, 120, rng)
    y, x = np.mgrid[0:120, 0:160]
    for centre in rng.uniform(20, 90, (4, 2)):
        image += 30 * np.exp(-((x - centre[0]) ** 2 + (y - centre[1]) ** 2) / 18)[..., None] * [1, 0.9, 0.7]
    a, b = image[8:112, 8:152], 1.1 * image[9:113, 10:154]
    for name, pixels in [("hdr_a.exr", a), ("hdr_b.exr", b)]:
        write_exr(name, {"RGB": np.ascontiguousarray(pixels.astype(np.float16))})
    coverage = np.clip(20 - np.hypot(x - 70, y - 60) + 0.5, 0, 1)[8:112, 8:152]
    write_exr("hdr_coverage.exr", {"coverage.Y": np.ascontiguousarray(coverage.astype(np.float16))})


if __name__ == "__main__":
    main()
