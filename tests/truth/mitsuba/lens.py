"""The lenses of the two cameras, by OpenCV: where each part of a pixel looks, and pictures warped accordingly.

Pixels as in OpenCV: the centre of pixel (0, 0) is at (0, 0). Every pixel of a warped picture is the mean of PARTS x PARTS
places of its square, each interpolated bilinearly in a pinhole picture at least three times as dense.
"""

import tomllib

import cv2
import numpy as np

PARTS = 8
DENSITY = 6
# Pixels of a pinhole picture beyond what is looked at.
MARGIN = 4


def read(path):
    """(size, camera matrix, coefficients, rest) of a calibration file."""
    with open(path, "rb") as file:
        calibration = tomllib.load(file)
    lens = calibration["lens"]
    matrix = np.array([[lens["fx"], 0, lens["cx"]], [0, lens["fy"], lens["cy"]], [0, 0, 1]])
    names = {"brown_conrady5": ("k1", "k2", "p1", "p2", "k3"), "kannala_brandt4": ("k1", "k2", "k3", "k4")}
    return calibration["size_px"], matrix, np.array([lens[name] for name in names[lens["model"]]]), calibration


def places(size, parts):
    """Centres of parts x parts squares of each pixel, (height * parts, width * parts, 2)."""
    x, y = (-0.5 + (np.arange(side * parts) + 0.5) / parts for side in size)
    return np.stack(np.meshgrid(x, y), axis=-1)


def mean_of_parts(image, parts):
    height, width = image.shape[0] // parts, image.shape[1] // parts
    return image.reshape(height, parts, width, parts, -1).mean(axis=(1, 3))


class Pinhole:
    """A picture without distortion. `focal` and `principal` in its pixels, `rotation` = camera from pinhole."""

    def __init__(self, focal, principal, size, rotation=None):
        self.focal, self.principal, self.size = focal, np.asarray(principal), size
        self.rotation = np.eye(3) if rotation is None else rotation

    def pixels(self, plane):
        """Of positions on the plane z = 1."""
        return self.focal * plane + self.principal


class Camera:
    """The see-through camera: `pinhole` is the picture that it is warped from."""

    def __init__(self, path):
        self.size, self.matrix, self.coefficients, _ = read(path)
        self.plane = self.undistorted(places(self.size, PARTS))
        low, high = self.plane.min(axis=(0, 1)), self.plane.max(axis=(0, 1))
        # The camera's own pinhole picture, larger and DENSITY times as dense: the principal point stays where it is
        # within its pixel.
        centre = np.array([self.matrix[0, 2], self.matrix[1, 2]])
        focal = DENSITY * max(self.matrix[0, 0], self.matrix[1, 1])
        low, high = (focal / DENSITY * corner + centre for corner in (low, high))
        over = int(np.ceil(np.max([-0.5 - low, high - np.array(self.size) + 0.5]))) + 1
        size = (np.array(self.size) + 2 * over) * DENSITY
        principal = DENSITY * (centre + 0.5 + over) - 0.5
        self.pinhole = Pinhole(focal, principal, size)
        positions = self.pinhole.pixels(self.plane)
        assert positions.min() >= 0 and (positions.max(axis=(0, 1)) <= size - 1).all(), "more overscan is needed"
        self.map = positions.astype(np.float32)

    def undistorted(self, pixels):
        """On the plane z = 1."""
        flat = pixels.reshape(-1, 1, 2)
        criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 60, 1e-10)
        plane = cv2.undistortPoints(flat, self.matrix, self.coefficients, criteria=criteria)
        back = self.project(np.concatenate([plane[:, 0], np.ones((len(plane), 1))], axis=1))
        assert np.abs(back - flat[:, 0]).max() < 1e-5, "OpenCV did not invert the lens"
        return plane.reshape(pixels.shape)

    def project(self, points):
        """Points of the camera's frame, (n, 3), to pixels, (n, 2)."""
        return cv2.projectPoints(points, np.zeros(3), np.zeros(3), self.matrix, self.coefficients)[0][:, 0]

    def warp(self, images):
        """From the pinhole's picture."""
        return mean_of_parts(remap(images[0], self.map), PARTS)

    @property
    def pinholes(self):
        return [self.pinhole]


class Fisheye:
    """The fish-eye: `pinholes` are five faces of a cube, forward, right, left, down, up."""

    FACE_PX = 640

    def __init__(self, path):
        self.size, self.matrix, self.coefficients, calibration = read(path)
        largest = np.radians(calibration["image_circle"]["max_angle_deg"])
        self.check_polynomial()
        side, half = self.FACE_PX + 2 * MARGIN, self.FACE_PX / 2
        x, y, z = np.eye(3)
        # Columns: right, down and forward of each face, in the camera's frame. The upper face's up is backward.
        axes = [(x, y, z), (-z, y, x), (z, y, -x), (x, -z, y), (x, z, -y)]
        self.pinholes = [Pinhole(half, [side / 2 - 0.5] * 2, np.array([side, side]), np.stack(columns, axis=1))
                         for columns in axes]
        directions = self.directions(places(self.size, PARTS))
        seen = np.arccos(np.clip(directions[..., 2], -1, 1)) <= largest
        towards = np.stack([directions @ pinhole.rotation[:, 2] for pinhole in self.pinholes])
        face = np.where(seen, towards.argmax(axis=0), -1)
        self.parts = []
        for number, pinhole in enumerate(self.pinholes):
            local = directions @ pinhole.rotation
            with np.errstate(divide="ignore", invalid="ignore"):
                positions = pinhole.pixels(local[..., :2] / local[..., 2:])
            chosen = face == number
            assert positions[chosen].min() >= 0 and positions[chosen].max() <= side - 1
            self.parts.append((chosen, np.where(chosen[..., None], positions, 0).astype(np.float32)))

    def radius(self, angle):
        k1, k2, k3, k4 = self.coefficients
        square = angle * angle
        return angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4))))

    def check_polynomial(self):
        """OpenCV projects what lies in front of the camera only; beyond 90° the same polynomial goes on."""
        angle, around = np.meshgrid(np.radians(np.linspace(0, 89, 90)), np.radians(np.arange(0, 360, 15)))
        points = np.stack([np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle)], axis=-1)
        difference = self.project(points.reshape(-1, 3)) - self.project_wide(points.reshape(-1, 3))
        assert np.abs(difference).max() < 1e-9, "not the fish-eye lens of OpenCV"

    def project(self, points):
        """By OpenCV: points of the camera's frame, (n, 3), z > 0, to pixels, (n, 2)."""
        zero = np.zeros((1, 1, 3))
        return cv2.fisheye.projectPoints(points[:, None], zero, zero, self.matrix, self.coefficients)[0][:, 0]

    def project_wide(self, points):
        """The same for all directions."""
        across = np.hypot(points[:, 0], points[:, 1])
        scale = self.radius(np.arctan2(across, points[:, 2])) / np.maximum(across, 1e-300)
        plane = points[:, :2] * scale[:, None]
        return plane * [self.matrix[0, 0], self.matrix[1, 1]] + self.matrix[:2, 2]

    def directions(self, pixels):
        """Unit directions, by Newton's method on the polynomial."""
        plane = (pixels - self.matrix[:2, 2]) / [self.matrix[0, 0], self.matrix[1, 1]]
        radius = np.hypot(plane[..., 0], plane[..., 1])
        k = self.coefficients
        angle = radius.copy()
        for _ in range(30):
            slope = 1 + sum((2 * i + 3) * k[i] * angle ** (2 * i + 2) for i in range(4))
            angle -= (self.radius(angle) - radius) / slope
        assert np.abs(self.radius(angle) - radius).max() < 1e-9, "the polynomial cannot be inverted"
        across = plane * (np.sin(angle) / np.maximum(radius, 1e-300))[..., None]
        return np.concatenate([across, np.cos(angle)[..., None]], axis=-1)

    def warp(self, images):
        """From the pictures of `pinholes`; 0 outside of the image circle."""
        whole = 0
        for image, (chosen, positions) in zip(images, self.parts):
            whole = whole + remap(image, positions) * chosen[..., None]
        return mean_of_parts(whole, PARTS)


def remap(image, positions):
    image = np.ascontiguousarray(image, dtype=np.float32)
    warped = cv2.remap(image, positions, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return warped.reshape(*positions.shape[:2], -1)
