#!/usr/bin/env python3
"""Writes lens/tests/data/opencv_points.json: points projected and pixels unprojected by others than coshade.

    python -m venv venv && venv/bin/pip install 'opencv-python-headless==4.*'
    venv/bin/python tests/peers/opencv_lens.py > lens/tests/data/opencv_points.json

pinhole, brown_conrady5, rational8: cv2.projectPoints, cv2.undistortPointsIter (iterated until it stands still)
kannala_brandt4:                    cv2.fisheye.projectPoints, cv2.fisheye.undistortPoints (Z > 0 only, as in OpenCV),
                                    and the published polynomial for Z <= 0
double_sphere, eucm:                the published formulas in 50 digits (Usenko et al. 2018, eq. 40-52;
                                    Khomutenko et al. 2016)

A pixel is kept only if the peer's ray projects back onto it within 1e-10 px, that is, where the peer itself converged.
"""

import json
import math
import sys
from decimal import Decimal, getcontext

import cv2
import numpy as np

getcontext().prec = 50

# (name, model, parameters, largest angle in degrees, image size). The named real lenses are OpenCV calibrations of
# public image sets: OCamCalib's Fisheye1, CamOdoCal's example, OpenCV's left01..14, swatbotics, TUM VI.
LENSES = [
    ("plain", "pinhole", [500, 510, 320.25, 239.5], 80, (640, 480)),
    ("narrow", "pinhole", [3000, 2990, 1999.5, 1499.5], 40, (4000, 3000)),
    ("opencv left", "brown_conrady5",
     [531.8859407432808, 531.9011377636916, 341.9898269119211, 233.07539851896905,
      -0.31092504086623896, 0.1635773849673826, 0.0009158410844452289, 0.0004352950874299363,
      -0.023615602417456708], 42, (640, 480)),
    ("swatbotics", "brown_conrady5",
     [770.1580957317658, 768.8064524863431, 393.9365964768836, 315.1156510647011,
      -0.033117304092153896, 2.391263174730632, 0.005463886226519844, -0.0009056000333327246,
      -13.257995410324297], 22, (816, 612)),
    ("pincushion", "brown_conrady5", [700, 690, 639.5, 359.5, 0.12, 0.03, -0.002, 0.001, 0.01], 60, (1280, 720)),
    ("kinect", "rational8",
     [610, 609, 638, 366, 0.62, -2.7, 0.0007, -0.0002, 1.6, 0.5, -2.5, 1.5], 35, (1280, 720)),
    ("wide", "rational8",
     [420, 421, 639.5, 479.5, 5.1, 2.4, -0.0003, 0.0002, 0.07, 5.5, 4.1, 0.6], 60, (1280, 960)),
    ("ocam fish1", "kannala_brandt4",
     [336.3363701915637, 336.052813105264, 543.0227556823396, 377.73078080462926,
      0.0024601996249886244, -0.007506536138431003, 0.000969490345068461, -0.00047307365277207946],
     95, (1032, 778)),
    ("camodocal", "kannala_brandt4",
     [384.70869944307634, 385.72375219727564, 639.4981112394985, 477.8760599400125,
      0.03276089261549451, -0.02967731071357875, 0.004865090955215051, 0.0005617612728804002],
     80, (1280, 960)),
    ("tumvi", "kannala_brandt4",
     [380.2885560924852, 380.17184518551096, 509.85470782932094, 514.3129791962297,
      0.0061346908747180375, -0.0032041121083643625, 0.0013445438036307667, -0.0006115262110153823],
     98, (1024, 1024)),
    ("linear", "kannala_brandt4", [300, 300, 511.5, 511.5, 0, 0, 0, 0], 175, (1024, 1024)),
    ("bf2m2020s23", "double_sphere", [313.21, 313.21, 638.66, 514.39, -0.18, 0.59], 110, (1280, 1024)),
    ("small alpha", "double_sphere", [250, 251, 319.5, 239.5, 0.3, 0.35], 100, (640, 480)),
    ("large alpha", "double_sphere", [200, 201, 319.5, 239.5, 0.6, 0.8], 100, (640, 480)),
    ("bf2m2020s23", "eucm", [377.6, 377.8, 638.6, 514.0, 0.6, 1.08], 100, (1280, 1024)),
    ("small alpha", "eucm", [250, 251, 319.5, 239.5, 0.3, 0.7], 95, (640, 480)),
    ("large alpha", "eucm", [200, 201, 319.5, 239.5, 0.85, 2.0], 80, (640, 480)),
]
IDENTITY = np.eye(3)


def sample_points(max_angle_deg):
    """Points at nine angles up to the largest, in directions and at distances that are not round."""
    points = []
    for i in range(10):
        theta = math.radians(max_angle_deg) * i / 9
        phi = 0.3 + 2.4 * i
        distance = 0.4 + 1.3 * i
        points.append([distance * math.sin(theta) * math.cos(phi), distance * math.sin(theta) * math.sin(phi),
                       distance * math.cos(theta)])
    return points


def sample_pixels(size):
    """A grid that goes off the image by a little."""
    width, height = size
    return [[width * (0.03 + 0.235 * i), height * (0.02 + 0.32 * j)] for i in range(5) for j in range(4)]


def camera_matrix(p):
    return np.array([[p[0], 0, p[2]], [0, p[1], p[3]], [0, 0, 1.0]])


class OpenCv:
    """Pinhole with OpenCV's distortion vector."""

    def __init__(self, params):
        self.k, self.d = camera_matrix(params), np.array(params[4:] or [0.0] * 4)

    def project(self, point):
        return cv2.projectPoints(np.array([[point]]), np.zeros(3), np.zeros(3), self.k, self.d)[0].ravel()

    def unproject(self, pixel):
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 10000, 1e-16)
        x, y = cv2.undistortPointsIter(np.array([[pixel]]), self.k, self.d, IDENTITY, IDENTITY, stop).ravel()
        return [x, y, 1.0]


class OpenCvFisheye:
    """cv2.fisheye, and its polynomial for points that are not in front of the camera."""

    def __init__(self, params):
        self.params = params
        self.k, self.d = camera_matrix(params), np.array(params[4:], float)

    def project(self, point):
        if point[2] > 0:
            return cv2.fisheye.projectPoints(np.array([[point]]), np.zeros(3), np.zeros(3), self.k, self.d)[0].ravel()
        x, y, z = point
        theta = math.atan2(math.hypot(x, y), z)
        odd = sum(k * theta ** (2 * i + 3) for i, k in enumerate(self.params[4:]))
        scale = (theta + odd) / math.hypot(x, y)
        return [self.params[0] * scale * x + self.params[2], self.params[1] * scale * y + self.params[3]]

    def unproject(self, pixel):
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-15)
        x, y = cv2.fisheye.undistortPoints(np.array([[pixel]]), self.k, self.d, criteria=stop).ravel()
        return [x, y, 1.0]


class DoubleSphere:
    """Usenko et al. 2018."""

    def __init__(self, params):
        self.fx, self.fy, self.cx, self.cy, self.xi, self.alpha = map(Decimal, params)

    def project(self, point):
        x, y, z = map(Decimal, point)
        d1 = (x * x + y * y + z * z).sqrt()  # 41
        d2 = (x * x + y * y + (self.xi * d1 + z) ** 2).sqrt()  # 42
        denominator = self.alpha * d2 + (1 - self.alpha) * (self.xi * d1 + z)
        return [float(self.fx * x / denominator + self.cx), float(self.fy * y / denominator + self.cy)]  # 40

    def unproject(self, pixel):
        mx = (Decimal(pixel[0]) - self.cx) / self.fx
        my = (Decimal(pixel[1]) - self.cy) / self.fy
        r2 = mx * mx + my * my
        inside = 1 - (2 * self.alpha - 1) * r2
        if inside < 0:
            return None
        mz = (1 - self.alpha**2 * r2) / (self.alpha * inside.sqrt() + 1 - self.alpha)  # 50
        scale = (mz * self.xi + (mz * mz + (1 - self.xi**2) * r2).sqrt()) / (mz * mz + r2)  # 46
        return [float(scale * mx), float(scale * my), float(scale * mz - self.xi)]


class Eucm:
    """Khomutenko et al. 2016."""

    def __init__(self, params):
        self.fx, self.fy, self.cx, self.cy, self.alpha, self.beta = map(Decimal, params)

    def project(self, point):
        x, y, z = map(Decimal, point)
        rho = (self.beta * (x * x + y * y) + z * z).sqrt()
        denominator = self.alpha * rho + (1 - self.alpha) * z
        return [float(self.fx * x / denominator + self.cx), float(self.fy * y / denominator + self.cy)]

    def unproject(self, pixel):
        mx = (Decimal(pixel[0]) - self.cx) / self.fx
        my = (Decimal(pixel[1]) - self.cy) / self.fy
        r2 = mx * mx + my * my
        gamma = 1 - self.alpha
        inside = 1 - (self.alpha - gamma) * self.beta * r2
        if inside < 0:
            return None
        mz = (1 - self.beta * self.alpha**2 * r2) / (self.alpha * inside.sqrt() + gamma)
        norm = (r2 + mz * mz).sqrt()
        return [float(mx / norm), float(my / norm), float(mz / norm)]


PEERS = {
    "pinhole": OpenCv,
    "brown_conrady5": OpenCv,
    "rational8": OpenCv,
    "kannala_brandt4": OpenCvFisheye,
    "double_sphere": DoubleSphere,
    "eucm": Eucm,
}


def table(name, model, params, max_angle_deg, size):
    params = [float(p) for p in params]
    peer = PEERS[model](params)
    projected = [{"point": p, "px": [float(c) for c in peer.project(p)]} for p in sample_points(max_angle_deg)]
    unprojected = []
    for pixel in sample_pixels(size):
        ray = peer.unproject(pixel)
        # A far angle means that the peer went astray on an image point that belongs to no ray of the lens.
        if ray is None or math.degrees(math.atan2(math.hypot(ray[0], ray[1]), ray[2])) > max_angle_deg:
            continue
        again = peer.project(ray)
        if math.hypot(again[0] - pixel[0], again[1] - pixel[1]) < 1e-10:
            unprojected.append({"px": pixel, "ray": [float(c) for c in ray]})
    return {"name": name, "model": model, "params": params, "projected": projected, "unprojected": unprojected}


def main():
    lenses = [table(*lens) for lens in LENSES]
    for lens in lenses:
        print(lens["model"], lens["name"], len(lens["projected"]), len(lens["unprojected"]), file=sys.stderr)
    json.dump({"opencv": cv2.__version__, "lenses": lenses}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
