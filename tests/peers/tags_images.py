"""Images with tags whose corners and poses are known, and images without any tag, for tags.py.

Positive: 1280 x 720, one to four tag36h11 on clutter; distances 0.5 to 4.5 m, tilts to 70 degrees, uneven light, blur of 0.4
to 1.8 px, noise of 1 to 8 codes; 15 % of the tags have a covered corner. Pixel centres are at whole numbers.
"""

import cv2
import numpy as np

WIDTH, HEIGHT = 1280, 720
CAMERA = np.array([[900.0, 0, 639.5], [0, 900.0, 359.5], [0, 0, 1]])
SIZE_M = 0.16
# Upper left, upper right, lower right, lower left, as solvePnP's IPPE_SQUARE wants them.
SQUARE = np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]) * SIZE_M / 2
MARKERS = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
SUBPIXELS = 4
CELL = 40  # texture pixels per cell


def clutter(rng):
    """Clouds of four sizes, and quadrilaterals."""
    picture = np.full((HEIGHT, WIDTH), 120, np.float32)
    for blur, amplitude in ((90, 45), (30, 20), (9, 12), (3, 8)):
        noise = cv2.GaussianBlur(rng.normal(size=(HEIGHT, WIDTH)).astype(np.float32), (0, 0), blur)
        picture += amplitude * noise / noise.std()
    for _ in range(rng.integers(10, 25)):
        corners = rng.integers(0, [WIDTH, HEIGHT], (4, 2))
        corners = corners.mean(0) + (corners - corners.mean(0)) * rng.uniform(0.05, 0.3)
        cv2.fillConvexPoly(picture, cv2.convexHull(corners.astype(np.int32)), float(rng.uniform(0, 255)))
    return np.clip(picture, 0, 255)


def homography(source, target):
    rows = []
    for (x, y), (u, v) in zip(source, target):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y, -u], [0, 0, 0, x, y, 1, -v * x, -v * y, -v]]
    return np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)


def paste(picture, texture, source, target, white, black):
    """The texture in perspective, each pixel the mean of SUBPIXELS x SUBPIXELS samples. source and target: four corners."""
    matrix = homography(source, target)
    height, width = texture.shape
    outline = np.array([[-0.5, -0.5, 1], [width - 0.5, -0.5, 1], [width - 0.5, height - 0.5, 1], [-0.5, height - 0.5, 1]])
    outline = outline @ matrix.T
    outline = outline[:, :2] / outline[:, 2:]
    x0, y0 = np.maximum(np.floor(outline.min(0) - 2).astype(int), 0)
    x1, y1 = np.minimum(np.ceil(outline.max(0) + 3).astype(int), [WIDTH, HEIGHT])
    if x1 <= x0 or y1 <= y0:
        return
    zoom = np.array([[SUBPIXELS, 0, -x0 * SUBPIXELS + (SUBPIXELS - 1) / 2],
                     [0, SUBPIXELS, -y0 * SUBPIXELS + (SUBPIXELS - 1) / 2], [0, 0, 1.0]])
    size = ((x1 - x0) * SUBPIXELS, (y1 - y0) * SUBPIXELS)
    mean = lambda fine: fine.astype(np.float32).reshape(y1 - y0, SUBPIXELS, x1 - x0, SUBPIXELS).mean((1, 3)) / 255
    value = mean(cv2.warpPerspective(texture, zoom @ matrix, size, flags=cv2.INTER_LINEAR))
    inside = mean(cv2.warpPerspective(np.full_like(texture, 255), zoom @ matrix, size, flags=cv2.INTER_LINEAR))
    part = picture[y0:y1, x0:x1]
    part[:] = part * (1 - inside) + black * inside + (white - black) * value


def pose(rng):
    distance = np.exp(rng.uniform(np.log(0.5), np.log(4.5)))
    place = rng.uniform(60, WIDTH - 60), rng.uniform(60, HEIGHT - 60)
    translation = distance * np.linalg.inv(CAMERA) @ [*place, 1]
    tilt, azimuth, roll = np.deg2rad(rng.uniform(0, 70)), rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi)
    lean = cv2.Rodrigues(np.array([np.cos(azimuth), np.sin(azimuth), 0]) * tilt)[0]
    turn = cv2.Rodrigues(np.array([0, 0, roll]))[0]
    return lean @ np.diag([1.0, -1, -1]) @ turn, translation


def place_tag(rng, picture, taken, number):
    """A tag drawn into the picture, or None where there was no room."""
    rotation, translation = pose(rng)
    if rotation[:, 2] @ translation >= -0.15 * np.linalg.norm(translation):
        return None
    projected = (SQUARE @ rotation.T + translation) @ CAMERA.T
    corners = projected[:, :2] / projected[:, 2:]
    if (corners < 12).any() or (corners > [WIDTH - 13, HEIGHT - 13]).any():
        return None
    low = np.maximum(np.floor(corners.min(0) - 14).astype(int), 0)
    high = np.minimum(np.ceil(corners.max(0) + 14).astype(int), [WIDTH, HEIGHT])
    room = taken[low[1]:high[1], low[0]:high[0]]
    side = np.sqrt(cv2.contourArea(corners.astype(np.float32)))
    if room.any() or side < 14:
        return None
    texture = np.full((10 * CELL, 10 * CELL), 255, np.uint8)
    # OpenCV draws AprilTags upside down.
    texture[CELL:-CELL, CELL:-CELL] = cv2.aruco.generateImageMarker(MARKERS, number, 8 * CELL)[::-1, ::-1]
    source = np.array([[1, 1], [9, 1], [9, 9], [1, 9]]) * CELL - 0.5
    paste(picture, texture, source, corners, rng.uniform(170, 240), rng.uniform(10, 50))
    room[:] = True
    covered = bool(rng.random() < 0.15)
    if covered:
        corner = np.round(corners[rng.integers(4)]).astype(int).tolist()
        cv2.circle(picture, corner, int(side * rng.uniform(0.05, 0.18)) + 1, float(rng.uniform(60, 200)), -1)
    return dict(id=number, corners_px=corners.tolist(), rotation=rotation.tolist(), translation_m=translation.tolist(),
                side_px=float(side), covered=covered)


def photographed(rng, light):
    """Light that falls off to one side, blur, noise."""
    angle = rng.uniform(0, 2 * np.pi)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    ramp = (x / WIDTH - 0.5) * np.cos(angle) + (y / HEIGHT - 0.5) * np.sin(angle)
    light = light * (1 + ramp * rng.uniform(0, 1.2)) * rng.uniform(0.5, 1.1)
    light = cv2.GaussianBlur(light, (0, 0), rng.uniform(0.4, 1.8))
    light += rng.normal(0, rng.uniform(1, 8), light.shape)
    return np.clip(light + 0.5, 0, 255).astype(np.uint8)


def with_tags(rng):
    """An image and its tags."""
    picture = clutter(rng)
    wanted = rng.integers(1, 5)
    numbers = rng.choice(587, wanted, replace=False)
    taken = np.zeros((HEIGHT, WIDTH), bool)
    tags = []
    for _ in range(200):
        if len(tags) == wanted:
            break
        tag = place_tag(rng, picture, taken, int(numbers[len(tags)]))
        tags += [tag] if tag else []
    return photographed(rng, picture), tags


def only_clutter(rng):
    light = cv2.GaussianBlur(clutter(rng), (0, 0), 0.7) + rng.normal(0, 3, (HEIGHT, WIDTH))
    return np.clip(light, 0, 255).astype(np.uint8)
