"""Mitsuba: pinhole pictures of a scene's real or mixed world."""

import os
import sys

import mitsuba as mi
import numpy as np

import studio

# Mitsuba's units per metre. It starts rays (1 + largest coordinate) * 0.00009 units off a surface: in metres a tenth of a
# millimetre, which beneath a ball that nearly touches a box brightens or darkens the box by 0.3 %.
UNITS = 100
# Segments of a path, one more than scattering events (`max_depth` of the world files).
MAX_SEGMENTS = 17


def choose_variant():
    for variant in ("cuda_ad_rgb", "llvm_ad_rgb"):
        try:
            mi.set_variant(variant)
            return variant
        except ImportError as error:
            print(f"{variant} is not available: {error}", file=sys.stderr)
    sys.exit("error: neither CUDA nor LLVM: install LLVM 16 or newer and set DRJIT_LIBLLVM_PATH to its libLLVM.so")


def rgb(value):
    return {"type": "rgb", "value": [float(v) for v in value]}


def shape(shape, emitted=None):
    """A shape; with `emitted` it glows so and reflects nothing."""
    radiance = shape.radiance if emitted is None else emitted
    albedo = shape.albedo if radiance is None else (0, 0, 0)
    to_world = mi.ScalarTransform4f().scale([UNITS] * 3) @ shape.geometry["to_world"]
    made = dict(shape.geometry, to_world=to_world, bsdf={"type": "diffuse", "reflectance": rgb(albedo)})
    if radiance is not None:
        made["emitter"] = {"type": "area", "radiance": rgb(radiance)}
    return made


def environment(texels):
    """Mitsuba's map has +y up, its middle column looks along +z, and -x is to the right of that. Columns: where its x, y
    and z lie in the world."""
    to_world = np.eye(4)
    to_world[:3, :3] = np.stack([[0, 1, 0], [0, 0, 1], [1, 0, 0]], axis=1)
    return {"type": "envmap", "bitmap": mi.Bitmap(studio.for_mitsuba(texels)),
            "to_world": mi.ScalarTransform4f(to_world)}


def loaded(made):
    """In order: loaded in parallel, emitters come in any, and the two worlds then use the same random numbers differently."""
    return mi.load_dict(made, parallel=False, optimize=False)


def light_scene(case, mixed):
    """What shines and what it shines on."""
    made = {"type": "scene", "integrator": {"type": "path", "max_depth": MAX_SEGMENTS}}
    made |= {f"shape_{i}": shape(s) for i, s in enumerate(case.shapes) if mixed or not s.virtual}
    if case.environment is not None:
        made["environment"] = environment(case.environment)
    return loaded(made)


def mask_scene(case):
    """What is virtual glows red, all surfaces green: the share of a pixel that they take. Lights are no surfaces."""
    made = {"type": "scene", "integrator": {"type": "path", "max_depth": 1}}
    made |= {f"shape_{i}": shape(s, (float(s.virtual), 1, 0))
             for i, s in enumerate(case.shapes) if s.radiance is None}
    return loaded(made)


def surface_scene(case, mixed=True):
    """Position (in Mitsuba's units), normal and albedo of the first surface; 0 where there is none."""
    made = {"type": "scene", "integrator": {"type": "aov", "aovs": "p:position,n:sh_normal,a:albedo"}}
    made |= {f"shape_{i}": shape(s) for i, s in enumerate(case.shapes)
             if s.radiance is None and (mixed or not s.virtual)}
    return loaded(made)


def sensor(pinhole, world_from_camera):
    """Mitsuba's camera: x left, y up, z forward. Its film counts from the corner of the first pixel, not from its centre,
    and its offset of the principal point is in shares of the film's size, positive when the film moves to the right and
    up: see `prove.py`."""
    width, height = (int(side) for side in pinhole.size)
    to_world = np.eye(4)
    to_world[:3, :3] = world_from_camera[:3, :3] @ pinhole.rotation @ np.diag([-1.0, -1.0, 1.0])
    to_world[:3, 3] = UNITS * world_from_camera[:3, 3]
    offset = 0.5 - (pinhole.principal + 0.5) / pinhole.size
    return mi.load_dict({
        "type": "perspective", "fov_axis": "x",
        "fov": float(2 * np.degrees(np.arctan(width / (2 * pinhole.focal)))),
        "principal_point_offset_x": float(offset[0]), "principal_point_offset_y": float(offset[1]),
        "near_clip": 1e-3 * UNITS, "far_clip": 1e3 * UNITS,
        "to_world": mi.ScalarTransform4f(to_world),
        "sampler": {"type": "independent"},
        "film": {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb",
                 "component_format": "float32", "rfilter": {"type": "box"}}})


class View:
    """A lens at a place."""

    def __init__(self, lens, world_from_camera):
        self.lens = lens
        self.sensors = [sensor(pinhole, world_from_camera) for pinhole in lens.pinholes]

    def picture(self, scene, samples, seed):
        """Through the lens, (height, width, channels)."""
        images = [np.array(mi.render(scene, sensor=one, spp=samples, seed=seed * len(self.sensors) + i))
                  for i, one in enumerate(self.sensors)]
        return self.lens.warp(images)


def depth_at_centres(case, lens, world_from_camera):
    """z of the first real surface along the ray through each pixel's centre, metres; 0 where there is none."""
    scene = surface_scene(case, mixed=False)
    width, height = lens.size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)
    plane = lens.undistorted(pixels).reshape(-1, 2)
    local = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
    length = np.linalg.norm(local, axis=1)
    towards = (world_from_camera[:3, :3] @ (local / length[:, None]).T).astype(np.float32)
    origin = mi.Point3f(*(UNITS * float(v) for v in world_from_camera[:3, 3]))
    distance = np.array(scene.ray_intersect_preliminary(mi.Ray3f(origin, mi.Vector3f(towards))).t) / UNITS
    return np.where(np.isfinite(distance), distance / length, 0).reshape(height, width)
