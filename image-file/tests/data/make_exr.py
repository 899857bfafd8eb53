"""Makes small EXR files of many kinds with the reference implementation, and what it reads back from them.

    python make_exr.py              (numpy, OpenEXR >= 3.3)

`expected.json` holds per file and channel the sum and the first and last sample that OpenEXR itself reads.
"""

import json
from pathlib import Path

import numpy as np
import OpenEXR

HERE = Path(__file__).parent / "exr"
WIDTH, HEIGHT = 37, 23


def plane(seed, dtype=np.float32):
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    values = (x * 3 + y * 7 + seed * 11) % 64 / 16
    return np.ascontiguousarray(values.astype(dtype))


def header(**more):
    return {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | more


def rgb(dtype=np.float32):
    return {name: plane(seed, dtype) for seed, name in enumerate("RGB")}


def window(x, y, width, height):
    return (np.array([x, y], np.int32), np.array([x + width - 1, y + height - 1], np.int32))


def files():
    kinds = {
        "none": OpenEXR.NO_COMPRESSION,
        "rle": OpenEXR.RLE_COMPRESSION,
        "zips": OpenEXR.ZIPS_COMPRESSION,
        "zip": OpenEXR.ZIP_COMPRESSION,
        "piz": OpenEXR.PIZ_COMPRESSION,
        "pxr24": OpenEXR.PXR24_COMPRESSION,
        "b44": OpenEXR.B44_COMPRESSION,
        "dwaa": OpenEXR.DWAA_COMPRESSION,
    }
    for name, compression in kinds.items():
        yield f"{name}.exr", header(compression=compression), rgb(np.float16)
    yield "float_piz.exr", header(compression=OpenEXR.PIZ_COMPRESSION), rgb()
    tiles = OpenEXR.TileDescription()
    tiles.xSize, tiles.ySize = 16, 8
    tiles.mode = OpenEXR.ONE_LEVEL
    yield "tiled.exr", header(type=OpenEXR.tiledimage, tiles=tiles), rgb(np.float16)
    yield "alpha_depth_id.exr", header(), rgb(np.float16) | {
        "A": plane(5, np.float16),
        "Z": plane(6),
        "id": plane(7).astype(np.uint32),
    }
    yield "layers.exr", header(), {
        f"{layer}.{name}": plane(seed + 3 * index)
        for index, layer in enumerate(["real", "mixed"])
        for seed, name in enumerate("RGB")
    } | {"depth_z_m.Z": plane(9), "normal.X": plane(1), "normal.Y": plane(2), "normal.Z": plane(3)}
    yield "window.exr", header(
        dataWindow=window(-5, 12, WIDTH, HEIGHT), displayWindow=window(0, 0, 64, 48)
    ), rgb(np.float16)


def write_parts(name):
    parts = [
        OpenEXR.Part(header(), rgb(np.float16), "beauty"),
        OpenEXR.Part(header(), {"Z": plane(4)}, "depth"),
    ]
    OpenEXR.File(parts).write(str(HERE / name))


def main():
    HERE.mkdir(exist_ok=True)
    for name, attributes, channels in files():
        OpenEXR.File(attributes, channels).write(str(HERE / name))
    write_parts("parts.exr")
    expected = {}
    for path in sorted(HERE.glob("*.exr")):
        with OpenEXR.File(str(path), separate_channels=True) as file:
            expected[path.name] = {}
            for part in file.parts:
                many = len(file.parts) > 1
                for name, channel in part.channels.items():
                    pixels = channel.pixels.astype(np.float64)
                    full = f"{part.name()}.{name}" if many else name
                    corners = [float(pixels[0, 0]), float(pixels[-1, -1])]
                    expected[path.name][full] = [*pixels.shape[::-1], float(pixels.sum()), *corners]
    (HERE / "expected.json").write_text(json.dumps(expected, indent=1) + "\n")


if __name__ == "__main__":
    main()
