"""The environment of 1_shadow: a small studio, drawn by formula.

Equirectangular, upper edge up, radiance; its middle column looks along the world's +x, columns to the right of it
towards -y.
"""

import numpy as np

SIZE = (128, 64)


def direction(azimuth_deg, elevation_deg):
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


def rise(x, low, high):
    """0 up to low, 1 from high on, smooth between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def texels():
    """Array (rows, columns, 3)."""
    width, height = SIZE
    u, v = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    azimuth, elevation = np.meshgrid((0.5 - u) * 360, (0.5 - v) * 180)
    z = np.sin(np.radians(elevation))[..., None]
    sky = np.array([0.30, 0.36, 0.46]) * (0.55 + 0.45 * z)
    # Towards azimuth -30° it is lighter.
    sky = sky * (1 + 0.5 * np.cos(np.radians(azimuth + 30)) * np.cos(np.radians(elevation)))[..., None]
    image = np.where(z > 0, sky, np.array([0.05, 0.045, 0.04]))
    towards = np.stack(np.broadcast_arrays(np.cos(np.radians(elevation)) * np.cos(np.radians(azimuth)),
                                           np.cos(np.radians(elevation)) * np.sin(np.radians(azimuth)), z[..., 0]), -1)
    from_sun = np.degrees(np.arccos(np.clip(towards @ direction(160, 40), -1, 1)))
    image = image + np.array([88.0, 72.0, 52.0]) * (1 - rise(from_sun, 4.5, 7.5))[..., None]
    # A soft box: 36° wide, 24° high, cool.
    box = (1 - rise(np.abs(azimuth + 75), 16, 20)) * (1 - rise(np.abs(elevation - 42), 10, 14))
    return (image + np.array([0.9, 1.3, 1.9]) * box[..., None]).astype(np.float16).astype(np.float32)


def for_mitsuba(image):
    """The same piecewise bilinear function as Mitsuba reads it: it has rows at both poles, an equirectangular picture
    has half a row of margin there. With twice the rows and one more all knots are in both."""
    height = len(image)
    rows = [image[min(max((row - 1) // 2, 0), height - 1)] * 0.5 + image[min(row // 2, height - 1)] * 0.5
            for row in range(2 * height + 1)]
    return np.stack(rows)
