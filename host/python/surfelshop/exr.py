"""Reads the EXR files that the program writes: scan lines of floats, without loss, bit for bit.

Source: "OpenEXR File Layout" and "Technical Introduction to OpenEXR", openexr.com.
"""

import struct
import zlib

import numpy

MAGIC = b"\x76\x2f\x31\x01"
TYPES = {0: numpy.dtype("<u4"), 1: numpy.dtype("<f2"), 2: numpy.dtype("<f4")}
#: Compression: number of scan lines in a block, for none, ZIPS and ZIP.
LINES = {0: 1, 2: 1, 3: 16}


def read(path):
    """All channels by their names, such as `R`, `A` or `depth.Z`, each an array of rows x columns."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:4] != MAGIC:
        raise ValueError(f"{path}: expected an EXR file")
    version = struct.unpack_from("<I", data, 4)[0]
    if version & ~0xFF & ~0x400:
        raise ValueError(f"{path}: expected one part of scan lines, found tiles, depths or several parts")
    attributes, at = _attributes(data, 8)
    compression = attributes["compression"][0]
    if compression not in LINES:
        raise ValueError(f"{path}: expected no compression or ZIP, found number {compression}")
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    channels = _channels(attributes["channels"])
    found = {name: numpy.empty((height, width), kind) for name, kind in channels}
    lines = LINES[compression]
    n_blocks = -(-height // lines)
    for offset in struct.unpack_from(f"<{n_blocks}Q", data, at):
        first, size = struct.unpack_from("<iI", data, offset)
        rows = min(lines, bottom + 1 - first)
        expected = rows * width * sum(kind.itemsize for _, kind in channels)
        block = data[offset + 8 : offset + 8 + size]
        # A block that would not get smaller is stored as it is.
        if compression and size < expected:
            block = _inflated(block)
        if len(block) != expected:
            raise ValueError(f"{path}: expected {expected} bytes in a block, found {len(block)}")
        place = 0
        for row in range(first - top, first - top + rows):
            for name, kind in channels:
                found[name][row] = numpy.frombuffer(block, kind, width, place)
                place += width * kind.itemsize
    return found


def _attributes(data, at):
    found = {}
    while data[at]:
        name, at = _word(data, at)
        _kind, at = _word(data, at)
        size = struct.unpack_from("<I", data, at)[0]
        found[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    return found, at + 1


def _channels(data):
    found, at = [], 0
    while data[at]:
        name, at = _word(data, at)
        kind, _linear, across, down = struct.unpack_from("<iB3xii", data, at)
        if (across, down) != (1, 1):
            raise ValueError(f"channel {name}: expected a value for each pixel")
        found.append((name, TYPES[kind]))
        at += 16
    return found


def _word(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _inflated(block):
    """Undoes deflate, then the differences between bytes, then the order of the two halves."""
    stored = numpy.frombuffer(zlib.decompress(block), numpy.uint8).astype(numpy.int64)
    stored[1:] -= 128
    summed = (numpy.cumsum(stored) & 0xFF).astype(numpy.uint8)
    half = (len(summed) + 1) // 2
    whole = numpy.empty_like(summed)
    whole[0::2] = summed[:half]
    whole[1::2] = summed[half:]
    return whole.tobytes()
