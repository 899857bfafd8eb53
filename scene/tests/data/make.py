#!/usr/bin/env python3
"""Writes the small meshes of the import tests with independent writers, and what those say about them.

    pip install trimesh pygltflib numpy pillow && python make.py

`placed.glb`, `placed.json`   trimesh: nested nodes, non-uniform and mirroring scales; area, volume, bounds by trimesh
`features.gltf/.bin`          pygltflib: strip, fan, sparse, normalised integers, textures, all material extensions
`cube_*.ply`                  trimesh: ASCII and binary
"""

import base64
import io
import json
import struct

import numpy as np
import pygltflib as g
import trimesh
from PIL import Image


def placed():
    scene = trimesh.Scene()
    box = trimesh.creation.box((0.2, 0.3, 0.4))
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.1)
    move = trimesh.transformations.translation_matrix
    turn = trimesh.transformations.rotation_matrix
    scene.add_geometry(box, node_name="base", geom_name="box", transform=move((1, 2, 3)) @ turn(0.5, (1, 1, 0)))
    scene.add_geometry(ball, node_name="stretched", geom_name="ball", parent_node_name="base",
                       transform=move((0, 0.5, 0)) @ np.diag((1, 2, 3, 1)) @ turn(0.3, (0, 0, 1)))
    scene.add_geometry(ball, node_name="mirrored", geom_name="ball", parent_node_name="base",
                       transform=move((0.5, 0, 0)) @ np.diag((-1.5, 1, 1, 1)))
    scene.export("placed.glb")
    # Read back: bounds are those of the file, in glTF's axes; here z is up.
    read = trimesh.load("placed.glb")
    mesh = read.to_geometry() if hasattr(read, "to_geometry") else read.dump(concatenate=True)
    turned = np.stack((mesh.vertices[:, 0], -mesh.vertices[:, 2], mesh.vertices[:, 1]), axis=1)
    json.dump({
        "triangles": len(mesh.faces),
        "area_m2": mesh.area,
        "volume_m3": sum(part.volume for part in mesh.split(only_watertight=False)),
        "min": turned.min(axis=0).tolist(),
        "max": turned.max(axis=0).tolist(),
    }, open("placed.json", "w"), indent=1)


class Binary:
    """Buffer views and accessors, each aligned to four bytes."""

    def __init__(self):
        self.data, self.views, self.accessors = b"", [], []

    def view(self, data, stride=None):
        self.data += b"\0" * (-len(self.data) % 4)
        self.views.append(g.BufferView(buffer=0, byteOffset=len(self.data), byteLength=len(data), byteStride=stride))
        self.data += data
        return len(self.views) - 1

    def accessor(self, array, kind, component, normalized=False, **more):
        view = self.view(array.tobytes())
        if kind == "VEC3" and component == g.FLOAT:
            more |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.accessors.append(g.Accessor(bufferView=view, componentType=component, count=len(array), type=kind,
                                         normalized=normalized, **more))
        return len(self.accessors) - 1


def features():
    b = Binary()
    f32 = lambda rows: np.array(rows, dtype="<f4")
    # A strip of two unit squares in z = 0 (glTF's z), and a fan of four triangles around its centre.
    strip = b.accessor(f32([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]])[[1, 0, 3, 2, 5, 4]],
                       "VEC3", g.FLOAT)
    uvs = b.accessor(np.array([[0, 0, 0, 0], [0, 255, 0, 0], [128, 0, 0, 0], [128, 255, 0, 0], [255, 0, 0, 0], [255, 255, 0, 0]],
                              dtype="u1"), "VEC2", g.UNSIGNED_BYTE, True)
    b.views[b.accessors[uvs].bufferView].byteStride = 4
    colors = b.accessor(np.array([[65535, 0, 0, 32768]] * 6, dtype="<u2"), "VEC4", g.UNSIGNED_SHORT, True)
    normals = b.accessor(f32([[0, 0, 1]] * 6), "VEC3", g.FLOAT)
    fan = b.accessor(f32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]), "VEC3", g.FLOAT)
    fan_indices = b.accessor(np.array([0, 1, 2, 3, 4, 1], dtype="u1"), "SCALAR", g.UNSIGNED_BYTE)
    # Two triangles; the sparse accessor lifts vertex 2 of the base to z = 5 and leaves the rest.
    base = f32([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    sparse = b.accessor(base, "VEC3", g.FLOAT)
    b.accessors[sparse].sparse = g.Sparse(
        count=1,
        indices=g.AccessorSparseIndices(bufferView=b.view(struct.pack("<H", 2)), componentType=g.UNSIGNED_SHORT),
        values=g.AccessorSparseValues(bufferView=b.view(f32([[0, 1, 5]]).tobytes())),
    )
    b.accessors[sparse].max = [1, 1, 5]

    picture = io.BytesIO()
    pixels = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], dtype="u1")
    Image.fromarray(pixels).save(picture, "PNG")
    Image.fromarray(pixels).save("two by two.png")
    uri = "data:image/png;base64," + base64.b64encode(picture.getvalue()).decode()

    transform = {"KHR_texture_transform": {"offset": [0.25, 0.5], "rotation": 0.5, "scale": [2, 3]}}
    rich = g.Material(
        name="rich",
        pbrMetallicRoughness=g.PbrMetallicRoughness(
            baseColorFactor=[0.5, 0.25, 0.125, 0.75], metallicFactor=0.25, roughnessFactor=0.5,
            baseColorTexture=g.TextureInfo(index=0, extensions=transform),
            metallicRoughnessTexture=g.TextureInfo(index=1)),
        normalTexture=g.NormalMaterialTexture(index=1, scale=0.5),
        occlusionTexture=g.OcclusionTextureInfo(index=1),
        emissiveFactor=[1, 0.5, 0], emissiveTexture=g.TextureInfo(index=0),
        alphaMode="MASK", alphaCutoff=0.25, doubleSided=True,
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 4}})
    glass = g.Material(name="glass", pbrMetallicRoughness=g.PbrMetallicRoughness(metallicFactor=0, roughnessFactor=0),
                       extensions={
                           "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": {"index": 1}},
                           "KHR_materials_ior": {"ior": 1.33},
                           "KHR_materials_volume": {"thicknessFactor": 0.5, "attenuationDistance": 0.1,
                                                    "attenuationColor": [0.2, 0.8, 0.4]}})
    document = g.GLTF2(
        asset=g.Asset(version="2.0"), scene=0, scenes=[g.Scene(nodes=[0])],
        nodes=[g.Node(name="root", children=[1, 2, 3], scale=[2, 2, 2]),
               g.Node(name="strip", mesh=0),
               g.Node(name="fan", mesh=1, translation=[0, 0, 1]),
               g.Node(name="sparse", mesh=2, translation=[10, 0, 0])],
        meshes=[g.Mesh(name="strip", primitives=[g.Primitive(
                    attributes=g.Attributes(POSITION=strip, NORMAL=normals, TEXCOORD_0=uvs, COLOR_0=colors),
                    mode=g.TRIANGLE_STRIP, material=0)]),
                g.Mesh(name="fan", primitives=[g.Primitive(
                    attributes=g.Attributes(POSITION=fan), indices=fan_indices, mode=g.TRIANGLE_FAN, material=1)]),
                g.Mesh(name="sparse", primitives=[g.Primitive(attributes=g.Attributes(POSITION=sparse))])],
        materials=[rich, glass],
        textures=[g.Texture(source=0, sampler=0), g.Texture(source=1)],
        samplers=[g.Sampler(magFilter=g.NEAREST, minFilter=g.LINEAR_MIPMAP_LINEAR, wrapS=g.CLAMP_TO_EDGE, wrapT=g.MIRRORED_REPEAT)],
        images=[g.Image(uri="two%20by%20two.png", name="beside"), g.Image(uri=uri)],
        accessors=b.accessors, bufferViews=b.views, buffers=[g.Buffer(byteLength=len(b.data), uri="features.bin")],
        extensionsUsed=["KHR_texture_transform", "KHR_materials_transmission", "KHR_materials_ior", "KHR_materials_volume",
                        "KHR_materials_emissive_strength", "KHR_lights_punctual"])
    open("features.bin", "wb").write(b.data)
    open("features.gltf", "w").write(document.to_json(indent=1))


def cubes():
    cube = trimesh.creation.box((1, 2, 3))
    cube.export("cube_ascii.ply", encoding="ascii")
    cube.export("cube_binary.ply", encoding="binary")


placed()
features()
cubes()
