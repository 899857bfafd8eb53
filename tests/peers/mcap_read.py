#!/usr/bin/env python3
"""Reads a recording with Foxglove's own Python packages and compares it with what the writer said it wrote.

    pip install mcap mcap-protobuf-support foxglove-schemas-protobuf numpy
    cargo run -p coshade-capture --example make_recording -- /tmp/r.mcap > /tmp/r.json
    python tests/peers/mcap_read.py /tmp/r.mcap /tmp/r.json

Checks schemas against the packages' own, counts, order, every pixel (CRC-32), all properties of the frames, the pairing
of images with their descriptions, calibrations, poses, the session record and the index. Prints one line of JSON.
"""

import collections
import json
import sys
import zlib

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

FOXGLOVE = {
    "foxglove.RawImage": RawImage,
    "foxglove.CompressedImage": CompressedImage,
    "foxglove.CameraCalibration": CameraCalibration,
    "foxglove.FrameTransform": FrameTransform,
}
ENCODINGS = {"YUYV": "yuyv", "UYVY": "uyvy", "NV12": "nv12", "GREY": "mono8", "Y16": "mono16", "Z16": "16UC1", "RGB24": "rgb8", "RGBF32": "32FC3"}


def same_layout(ours, theirs):
    """Whether the fields that the reader's package knows have the same numbers and types in the file's schema."""
    known = {field.name: (field.number, field.type) for field in theirs.fields}
    found = {field.name: (field.number, field.type) for field in ours.fields}
    return all(found.get(name) == value for name, value in known.items())


def main(recording, expectation):
    with open(expectation) as file:
        expected = json.load(file)
    wanted = collections.defaultdict(list)
    for frame in expected["frames"]:
        wanted[frame["stream"]].append(frame)
    infos, images, transforms, calibrations = collections.defaultdict(list), collections.defaultdict(list), [], 0
    with open(recording, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None and summary.chunk_indexes, "no index"
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            assert schema.encoding == channel.message_encoding == "protobuf"
            if schema.name in FOXGLOVE:
                assert same_layout(decoded.DESCRIPTOR, FOXGLOVE[schema.name].DESCRIPTOR), schema.name
                # The package's own class must read the bytes as well.
                decoded = FOXGLOVE[schema.name].FromString(message.data)
            stream = channel.topic.split("/")[1]
            if channel.topic == "/tf":
                transforms.append(decoded)
            elif schema.name == "coshade.FrameInfo":
                infos[stream].append((message, decoded))
            elif schema.name == "foxglove.CameraCalibration":
                assert list(decoded.K) == expected["k"] and decoded.distortion_model == "plumb_bob"
                calibrations += 1
            else:
                images[stream].append((message, decoded))
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = [attachment.name for attachment in reader.iter_attachments()]
    assert set(images) == set(wanted) == set(infos), (set(images), set(wanted))
    for stream, frames in wanted.items():
        assert len(images[stream]) == len(infos[stream]) == len(frames), stream
        for want, (message, image), (info_message, info) in zip(frames, images[stream], infos[stream]):
            pixels = np.frombuffer(image.data, dtype=np.uint8)
            assert pixels.size == want["bytes"] and zlib.crc32(pixels) == want["crc32"], (stream, want)
            assert message.log_time == info_message.log_time == info.captured_ns == want["log_time"]
            assert message.sequence == info_message.sequence
            assert image.timestamp.ToNanoseconds() == want["log_time"]
            assert (info.sequence, info.arrived_ns) == (want["sequence"], want["arrived_ns"])
            assert info.exposure_ns == want["exposure_ns"] and info.HasField("gain")
            assert info.HasField("depth_unit_m") == (stream == "Z16")
            assert info.stride_bytes == want["stride"]
            if stream == "MJPG":
                assert image.format == "jpeg"
            else:
                assert (image.encoding, image.step) == (ENCODINGS[stream], want["stride"])
    assert len(transforms) == expected["transforms"]
    assert [transform.translation.z for transform in transforms] == list(range(len(transforms)))
    assert calibrations == len(attachments) == len(wanted)
    assert metadata["coshade.session"]["session"] == expected["session"]
    counted = sum(summary.statistics.channel_message_counts.values())
    assert counted == 2 * len(expected["frames"]) + len(transforms) + calibrations
    print(json.dumps({"frames": len(expected["frames"]), "messages": counted, "chunks": len(summary.chunk_indexes), "ok": True}))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
