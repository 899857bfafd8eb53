"""Files: layered EXR in half floats, depth as 16-bit PNG."""

import cv2
import numpy as np
import OpenEXR

# Half floats of metres have steps of half a millimetre at 1 m: 32-bit floats, to 1/131072 m so that they can be compressed.
FULL_PRECISION = {"depth_z_m"}
DEPTH_STEPS_PER_M = 2 ** 17


def write_exr(path, layers):
    """`layers`: name of the layer (or "") to names of its channels and array (height, width, channels)."""
    channels = {}
    for layer, (names, image) in layers.items():
        image = image.reshape(*image.shape[:2], -1)
        kind = np.float32 if layer in FULL_PRECISION else np.float16
        for i, name in enumerate(names):
            values = np.ascontiguousarray(image[..., i].astype(kind))
            assert np.isfinite(values).all(), f"{path}: {layer}.{name} is not finite"
            channels[f"{layer}.{name}" if layer else name] = values
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, channels) as file:
        file.write(str(path))


def read_exr(path, layer, names):
    """Array (height, width, channels)."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return np.stack([channels[f"{layer}.{name}" if layer else name].pixels for name in names],
                        axis=-1).astype(np.float64)


def rounded_error(values):
    """To 2 binary digits, upwards: standard errors are not known any better, and files become smaller."""
    mantissa, exponent = np.frexp(values)
    return np.ldexp(np.ceil(mantissa * 4) / 4, exponent)


def rounded_depth(depth_m):
    return np.round(depth_m * DEPTH_STEPS_PER_M) / DEPTH_STEPS_PER_M


def write_depth(path, depth_m, unit_m):
    """0 where there is nothing."""
    counts = np.round(depth_m / unit_m)
    assert counts.max() < 65536, "too far for 16 bits"
    assert cv2.imwrite(str(path), counts.astype(np.uint16))
