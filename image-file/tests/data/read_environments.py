"""Statistics of environment maps as OpenEXR (EXR) and OpenCV (Radiance HDR) read them.

    python read_environments.py DIRECTORY > environments.json     (numpy, OpenEXR, opencv-python-headless)

Per file and channel: width, height, least, mean and largest sample.
"""

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import OpenEXR


def channels(path):
    if path.suffix == ".hdr":
        pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        return dict(zip("BGR", np.moveaxis(pixels, -1, 0)))
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


def statistics(plane):
    plane = plane.astype(np.float64)
    return [plane.shape[1], plane.shape[0], plane.min(), plane.mean(), plane.max()]


def main():
    files = sorted(p for p in Path(sys.argv[1]).iterdir() if p.suffix in (".hdr", ".exr"))
    found = {p.name: {name: statistics(c) for name, c in channels(p).items()} for p in files}
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
