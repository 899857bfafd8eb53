"""Images without any tag36h11 that look like some: squares, cells, stripes, letters. For tags.py."""

import string

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from tags_images import HEIGHT, WIDTH, clutter, paste, photographed

TEXTURE = 1200  # pixels along each side of a texture


def text(rng):
    """A page of letters: lines of several sizes, a table."""
    page = Image.new("L", (TEXTURE, TEXTURE), 255)
    draw = ImageDraw.Draw(page)
    letters = string.ascii_letters + string.digits + "  .,;#@&%[]{}()■□▪▫◆"
    y = 20
    while y < TEXTURE:
        size = int(rng.integers(10, 70))
        line = "".join(rng.choice(list(letters), int(2 * TEXTURE / size)))
        draw.text((20, y), line, fill=int(rng.integers(0, 60)), font=ImageFont.load_default(size))
        y += int(size * 1.3)
    for _ in range(6):
        x, y, side = (int(v) for v in rng.integers([0, 0, 40], [TEXTURE, TEXTURE, 250]))
        draw.rectangle((x, y, x + side, y + side), outline=0, width=int(rng.integers(2, 30)))
    return np.asarray(page)


def cells(rng, count, chance):
    return np.kron((rng.random((count, count)) < chance).astype(np.uint8) * 255,
                   np.ones((TEXTURE // count + 1,) * 2, np.uint8))[:TEXTURE, :TEXTURE]


def checkerboard(rng):
    side = int(rng.integers(15, 150))
    y, x = np.mgrid[0:TEXTURE, 0:TEXTURE] // side
    return ((x + y) % 2 * 255).astype(np.uint8)


def random_cells(rng):
    """A checkerboard whose colours are drawn by lot: every 8 x 8 of them is a code."""
    return cells(rng, int(rng.integers(10, 60)), rng.uniform(0.3, 0.7))


def blinds(rng):
    pitch, share = rng.uniform(8, 60), rng.uniform(0.2, 0.8)
    y, x = np.mgrid[0:TEXTURE, 0:TEXTURE]
    slats = np.where((y + 0.02 * x) % pitch < share * pitch, 235, 30).astype(np.uint8)
    for x0 in rng.integers(0, TEXTURE, 4):
        slats[:, x0:x0 + 12] = 20
    return slats


def qr_codes(rng):
    page = np.full((TEXTURE, TEXTURE), 255, np.uint8)
    encoder = cv2.QRCodeEncoder.create()
    for row in range(3):
        for column in range(3):
            message = "".join(rng.choice(list(string.ascii_letters), int(rng.integers(4, 90))))
            code = cv2.resize(encoder.encode(message), (360, 360), interpolation=cv2.INTER_NEAREST)
            page[20 + 400 * row:380 + 400 * row, 20 + 400 * column:380 + 400 * column] = code
    return page


def bricks(rng):
    height, width, joint = int(rng.integers(20, 80)), int(rng.integers(40, 180)), int(rng.integers(2, 12))
    y, x = np.mgrid[0:TEXTURE, 0:TEXTURE]
    row = y // height
    tone = rng.integers(30, 130, (TEXTURE // height + 1, TEXTURE // width + 2))
    shifted = x + (row % 2) * (width // 2)
    wall = tone[row, shifted // width]
    wall[(y % height < joint) | (shifted % width < joint)] = 220
    return wall.astype(np.uint8)


def barcodes(rng):
    page = np.full((TEXTURE, TEXTURE), 255, np.uint8)
    for row in range(4):
        for column in range(3):
            bars = np.repeat(rng.integers(0, 2, 90), 4)[:340] * 255
            page[30 + 300 * row:260 + 300 * row, 30 + 400 * column:370 + 400 * column] = bars
    return page


def other_markers(rng):
    """ArUco markers of other dictionaries, black border one cell wide like that of tag36h11. Those of 6 x 6 bits share their
    layout with tag36h11, and are its hardest neighbours: each has a chance of 1 in 44 000 (587 tags, 667 words each, four
    turns, of 2^36) to be a tag with two wrong bits."""
    names = ["DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000", "DICT_ARUCO_ORIGINAL",
             "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_6X6_250"]
    page = np.full((TEXTURE, TEXTURE), 255, np.uint8)
    for row in range(6):
        for column in range(6):
            dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, str(rng.choice(names))))
            number = int(rng.integers(0, len(dictionary.bytesList)))
            marker = cv2.aruco.generateImageMarker(dictionary, number, 150)
            page[25 + 200 * row:175 + 200 * row, 25 + 200 * column:175 + 200 * column] = marker
    return page


def facade(rng):
    """Windows with bars, some lit."""
    wall = np.full((TEXTURE, TEXTURE), int(rng.integers(150, 230)), np.uint8)
    pitch, count = int(rng.integers(70, 240)), int(rng.integers(2, 9))
    for y in range(10, TEXTURE, pitch):
        for x in range(10, TEXTURE, pitch):
            side = int(pitch * 0.75)
            cv2.rectangle(wall, (x, y), (x + side, y + side), int(rng.integers(5, 60)), -1)
            pane = side / count
            for i in range(count):
                for j in range(count):
                    if rng.random() < 0.4:
                        low = (int(x + pane * i + 2), int(y + pane * j + 2))
                        cv2.rectangle(wall, low, (int(low[0] + pane - 3), int(low[1] + pane - 3)), int(rng.integers(90, 255)), -1)
    return wall


KINDS = [text, checkerboard, random_cells, blinds, qr_codes, bricks, barcodes, other_markers, facade]


def negative(rng, number):
    """An image of a kind, name and pixels: the texture on clutter, in perspective, photographed."""
    kind = KINDS[number % len(KINDS)]
    picture = clutter(rng)
    corners = np.array([[0, 0], [TEXTURE, 0], [TEXTURE, TEXTURE], [0, TEXTURE]]) - 0.5
    target = np.array([[0, 0], [WIDTH, 0], [WIDTH, HEIGHT], [0, HEIGHT]]) * rng.uniform(0.6, 1.1)
    target = target + rng.uniform(-150, 150, (4, 2))
    paste(picture, kind(rng), corners, target, rng.uniform(170, 240), rng.uniform(5, 50))
    return kind.__name__, photographed(rng, picture)
