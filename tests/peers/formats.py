#!/usr/bin/env python3
"""Writes capture/tests/data/formats.json: what other decoders make of random frames.

    pip install numpy opencv-python-headless pillow av
    python tests/peers/formats.py

- `yuv`: YUYV, UYVY and NV12 frames of random bytes; for each matrix and range the R'G'B' codes by the formulas of the
  ITU in float64, with nearest and with linear chroma (siting of MPEG-2: on even columns, between rows);
  and OpenCV's (BT.601, limited, nearest).
- `flat`: frames of one colour by FFmpeg's swscale, for each matrix and range: an independent view of the coefficients.
- `linear`: RGBF32 frames of light, and its sRGB codes by the formula of IEC 61966-2-1 in float64.
- `jpeg`: small JPEG images and what Pillow (libjpeg-turbo, slow integer IDCT, fancy upsampling) decodes.

Bytes are written as hexadecimal text.
"""

import io
import json
from pathlib import Path

import av
import cv2
import numpy as np
from PIL import Image

WIDTH, HEIGHT = 16, 8
COEFFICIENTS = {"bt601": (0.299, 0.114), "bt709": (0.2126, 0.0722)}
RANGES = {"full": (0, 255, 255), "limited": (16, 219, 224)}
rng = np.random.default_rng(20240501)


def hexadecimal(array):
    return np.ascontiguousarray(array).tobytes().hex()


def rgb(y, cb, cr, matrix, code_range):
    """ITU-R BT.601 / BT.709 in float64; halves to even, as IEEE rounding has it."""
    kr, kb = COEFFICIENTS[matrix]
    kg = 1 - kr - kb
    black, luma_span, chroma_span = RANGES[code_range]
    y = (y - black) / luma_span
    cb = (cb - 128) / chroma_span
    cr = (cr - 128) / chroma_span
    r = y + 2 * (1 - kr) * cr
    b = y + 2 * (1 - kb) * cb
    g = (y - kr * r - kb * b) / kg
    return np.rint(255 * np.clip(np.stack([r, g, b], -1), 0, 1)).astype(np.uint8)


def spread_columns(half, linear):
    full = np.repeat(half, 2, axis=1)
    if linear:
        full[:, 1:-1:2] = (half[:, :-1] + half[:, 1:]) / 2
    return full


def spread_rows(half, linear):
    full = np.repeat(half, 2, axis=0)
    if linear:
        above = np.vstack([half[:1], half[:-1]])
        below = np.vstack([half[1:], half[-1:]])
        full[0::2] = (3 * half + above) / 4
        full[1::2] = (3 * half + below) / 4
    return full


def planes(name, data, linear):
    if name == "nv12":
        y = data[: WIDTH * HEIGHT].reshape(HEIGHT, WIDTH).astype(float)
        chroma = data[WIDTH * HEIGHT :].reshape(HEIGHT // 2, WIDTH // 2, 2).astype(float)
        return y, *(spread_columns(spread_rows(chroma[..., c], linear), linear) for c in (0, 1))
    pairs = data.reshape(HEIGHT, WIDTH // 2, 4).astype(float)
    y_at, cb_at, cr_at = ([0, 2], 1, 3) if name == "yuyv" else ([1, 3], 0, 2)
    y = pairs[..., y_at].reshape(HEIGHT, WIDTH)
    return y, spread_columns(pairs[..., cb_at], linear), spread_columns(pairs[..., cr_at], linear)


def opencv(name, data):
    code = {"yuyv": cv2.COLOR_YUV2RGB_YUYV, "uyvy": cv2.COLOR_YUV2RGB_UYVY, "nv12": cv2.COLOR_YUV2RGB_NV12}[name]
    shape = (HEIGHT * 3 // 2, WIDTH) if name == "nv12" else (HEIGHT, WIDTH, 2)
    return cv2.cvtColor(data.reshape(shape), code)


def yuv_cases():
    for name, size in (("yuyv", 2 * WIDTH * HEIGHT), ("uyvy", 2 * WIDTH * HEIGHT), ("nv12", WIDTH * HEIGHT * 3 // 2)):
        data = rng.integers(0, 256, size, dtype=np.uint8)
        expected = [
            {
                "matrix": matrix,
                "range": code_range,
                "chroma": "linear" if linear else "nearest",
                "rgb": hexadecimal(rgb(*planes(name, data, linear), matrix, code_range)),
            }
            for matrix in COEFFICIENTS
            for code_range in RANGES
            for linear in (False, True)
        ]
        yield {"format": name, "data": hexadecimal(data), "expected": expected, "opencv": hexadecimal(opencv(name, data))}


def flat_cases():
    spaces = {"bt601": av.video.reformatter.Colorspace.ITU601, "bt709": av.video.reformatter.Colorspace.ITU709}
    ranges = {"full": av.video.reformatter.ColorRange.JPEG, "limited": av.video.reformatter.ColorRange.MPEG}
    for matrix, space in spaces.items():
        for code_range, span in ranges.items():
            for _ in range(12):
                yuv = rng.integers(40, 216, 3, dtype=np.uint8)
                frame = av.VideoFrame(64, 64, "yuv444p")
                for plane, value in zip(frame.planes, yuv):
                    plane.update(bytes([value]) * plane.buffer_size)
                frame.colorspace, frame.color_range = space.value, span.value
                out = frame.reformat(
                    format="rgb24",
                    src_colorspace=space,
                    src_color_range=span,
                    dst_color_range=av.video.reformatter.ColorRange.JPEG,
                )
                yield {"matrix": matrix, "range": code_range, "yuv": yuv.tolist(), "rgb": out.to_ndarray()[32, 32].tolist()}


def picture(width, height):
    """Soft colours with edges and some noise: what a camera sends, not white noise."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    image = np.stack([120 + 90 * np.sin(x / 5), 130 + 80 * np.cos(y / 4 + x / 9), 90 + 5 * y + 2 * x], -1)
    image[height // 3 : height // 2, width // 4 : width // 2] = [200, 40, 30]
    return np.clip(image + rng.normal(0, 4, image.shape), 0, 255).astype(np.uint8)


def jpeg_cases():
    kinds = {
        "444": dict(subsampling=0),
        "422": dict(subsampling=1),
        "420": dict(subsampling=2),
        "420 progressive": dict(subsampling=2, progressive=True),
        "422 restart markers": dict(subsampling=1, restart_marker_blocks=2),
        "420 optimised tables": dict(subsampling=2, optimize=True),
        "rgb": dict(keep_rgb=True),
        "grey": dict(),
    }
    for kind, options in kinds.items():
        for width, height in ((48, 32), (37, 29)):
            image = Image.fromarray(picture(width, height))
            if kind == "grey":
                image = image.convert("L")
            buffer = io.BytesIO()
            image.save(buffer, "JPEG", quality=85, **options)
            luma = Image.open(buffer)
            luma.draft("L", luma.size)
            yield {
                "kind": kind,
                "width": width,
                "height": height,
                "jpeg": buffer.getvalue().hex(),
                "rgb": hexadecimal(np.asarray(Image.open(buffer).convert("RGB"))),
                "luma": hexadecimal(np.asarray(luma.convert("L"))),
            }


def srgb(light):
    light = np.clip(light, 0, 1)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def linear_case():
    """All orders of magnitude, both signs, and the numbers just beside the light of codes n + 1/2."""
    own = np.random.default_rng(20261122)
    code = (np.arange(128) * 2 + 0.5) / 255
    edges = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4).astype(np.float32)
    light = np.concatenate([
        own.choice([-1, 1], 128) * 10.0 ** own.uniform(-30, 30, 128),
        np.nextafter(edges, np.float32(0)),
        np.nextafter(edges, np.float32(2)),
    ]).astype("<f4")
    assert light.size == 3 * WIDTH * HEIGHT
    return {"data": hexadecimal(light), "rgb": hexadecimal(np.rint(255 * srgb(light.astype(float))).astype(np.uint8))}


def main():
    table = {
        "made_with": f"numpy {np.__version__}, opencv {cv2.__version__}, pyav {av.__version__}, "
        f"pillow {Image.__version__}",
        "width": WIDTH,
        "height": HEIGHT,
        "yuv": list(yuv_cases()),
        "flat": list(flat_cases()),
        "linear": linear_case(),
        "jpeg": list(jpeg_cases()),
    }
    path = Path(__file__).resolve().parents[2] / "capture/tests/data/formats.json"
    path.write_text(json.dumps(table, indent=1) + "\n")
    print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
