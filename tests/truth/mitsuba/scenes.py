"""The two scenes, written for Mitsuba by hand. Nothing here comes from the world files, which say the same in their own
words.

World: metres, +Z up. Cameras: x right, y down, z forward (OpenCV). Everything reflects diffusely.
"""

import cv2
import mitsuba as mi
import numpy as np

import studio

# Room under things, so that no two surfaces lie in one plane.
GAP = 0.0001


class Shape:
    def __init__(self, plugin, to_world, albedo=None, radiance=None, virtual=False, **more):
        self.albedo, self.radiance, self.virtual = albedo, radiance, virtual
        self.geometry = {"type": plugin, "to_world": to_world, **more}


class Case:
    """`camera` and `fisheye` are world_from_camera, 4 x 4."""

    def __init__(self, shapes, camera, fisheye, environment=None):
        self.shapes, self.camera, self.fisheye, self.environment = shapes, camera, fisheye, environment


def placed(position, turned_deg=0.0, scale=(1, 1, 1)):
    transform = mi.ScalarTransform4f
    return transform().translate(list(position)).rotate([0, 0, 1], turned_deg).scale(list(scale))


def box(size, position, albedo, turned_deg=0.0, virtual=False):
    """Mitsuba's cube reaches from -1 to 1."""
    return Shape("cube", placed(position, turned_deg, [side / 2 for side in size]), albedo, virtual=virtual)


def ball(radius, position, albedo, virtual=False):
    return Shape("sphere", mi.ScalarTransform4f(), albedo, virtual=virtual, center=list(position), radius=radius)


def wall(origin, right, up, albedo=None, radiance=None):
    """A rectangle around `origin`; `right` and `up` are its halves, seen from the side that its front faces."""
    right, up = np.array(right, dtype=float), np.array(up, dtype=float)
    front = np.cross(right, up) / np.linalg.norm(np.cross(right, up))
    to_world = np.eye(4)
    to_world[:3] = np.stack([right, up, front, origin], axis=1)
    return Shape("rectangle", mi.ScalarTransform4f(to_world), albedo, radiance)


def looking(position, target, roll_deg=0.0):
    """world_from_camera of an upright camera that is then turned about its axis, clockwise as seen from behind it."""
    forward = np.subtract(target, position) / np.linalg.norm(np.subtract(target, position))
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward], axis=1)
    rotation = rotation @ cv2.Rodrigues(np.radians([0, 0, roll_deg]))[0]
    return pose(rotation, position)


def pose(rotation, position):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    return matrix


def about(axis, angle_deg):
    return cv2.Rodrigues(np.radians(angle_deg) * np.array(axis, dtype=float))[0]


def shadow():
    """A box, a post and a ball on a desk in the studio."""
    shapes = [
        box([1.2, 0.8, 0.03], [0, 0, -0.015], [0.5, 0.42, 0.33]),
        box([0.12, 0.09, 0.08], [-0.06, 0.02, 0.04 + GAP], [0.7, 0.22, 0.12], 25, virtual=True),
        box([0.025, 0.025, 0.16], [0.06, 0.11, 0.08 + GAP], [0.6, 0.6, 0.55], -10, virtual=True),
        ball(0.045, [0.07, -0.03, 0.045 + GAP], [0.2, 0.4, 0.65], virtual=True),
    ]
    rotation = about([0, 0, 1], 35) @ about([0, 1, 0], -4) @ about([1, 0, 0], 6)
    return Case(shapes, looking([0.13, -0.37, 0.27], [0.02, 0.01, 0.03]), pose(rotation, [-0.27, -0.14, 0.03]),
                studio.texels())


def near_light():
    """A virtual box with a ball on it, beside a real one, on a desk in the corner of a room with a window in the left wall
    and a lamp in front to the right."""
    side = [0.62, 0.36, 0.28]
    x = -1.1
    shapes = [
        box([1.4, 1.0, 0.03], [0.05, 0.1, -0.015], [0.45, 0.38, 0.3]),
        wall([0.1, 0.9, 0.5], [1.2, 0, 0], [0, 0, 1.25], [0.6, 0.58, 0.52]),
        # Around the window, which is 0.8 m wide (y from -0.3 to 0.5) and 1.2 m high (z from 0.15 to 1.35).
        wall([x, -0.75, 0.5], [0, 0.45, 0], [0, 0, 1.25], side),
        wall([x, 0.7, 0.5], [0, 0.2, 0], [0, 0, 1.25], side),
        wall([x, 0.1, -0.3], [0, 0.4, 0], [0, 0, 0.45], side),
        wall([x, 0.1, 1.55], [0, 0.4, 0], [0, 0, 0.2], side),
        wall([x, 0.1, 0.75], [0, 0.4, 0], [0, 0, 0.6], radiance=[5.5, 6.4, 7.6]),
        lamp([0.9, -0.6, 1.1], [0, 0, 0], 0.2, [135, 112, 80]),
        box([0.09, 0.09, 0.2], [-0.15, 0.13, 0.1 + GAP], [0.2, 0.5, 0.22], -20),
        box([0.14, 0.1, 0.07], [0.03, 0.0, 0.035 + GAP], [0.7, 0.62, 0.2], 18, virtual=True),
        ball(0.045, [0.02, 0.0, 0.115 + 2 * GAP], [0.65, 0.65, 0.65], virtual=True),
    ]
    rotation = about([0, 0, 1], -50) @ about([1, 0, 0], -7)
    return Case(shapes, looking([0.16, -0.47, 0.32], [-0.03, 0.04, 0.06], roll_deg=4), pose(rotation, [0.36, -0.2, 0.03]))


def lamp(position, target, side, radiance):
    """A square that shines towards `target`."""
    matrix = looking(position, target)
    return wall(position, side / 2 * matrix[:3, 0], side / 2 * matrix[:3, 1], radiance=radiance)


CASES = {"1_shadow": shadow, "6_near_light": near_light}
