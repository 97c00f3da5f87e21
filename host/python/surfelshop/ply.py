"""Reads the binary PLY files that the program writes: one value, or a row of values, for each surfel."""

import numpy

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}
#: Properties that are one column together.
TOGETHER = {"position": ("x", "y", "z"), "normal": ("nx", "ny", "nz"), "color": ("red", "green", "blue")}


def read(path):
    """The columns of a cloud by their names; `position`, `normal` and `color` have three values a surfel."""
    with open(path, "rb") as file:
        fields, n_rows = _head(file, path)
        rows = numpy.frombuffer(file.read(n_rows * fields.itemsize), fields)
    if len(rows) != n_rows:
        raise ValueError(f"{path}: expected {n_rows} surfels, found {len(rows)}")
    names = list(fields.names)
    columns = {}
    for column, parts in TOGETHER.items():
        if all(part in names for part in parts):
            columns[column] = numpy.stack([rows[part] for part in parts], axis=1)
            names = [name for name in names if name not in parts]
    columns.update({name: rows[name].copy() for name in names})
    return columns


def _head(file, path):
    if file.readline().strip() != b"ply":
        raise ValueError(f"{path}: expected a PLY file")
    fields, n_rows, is_vertex = [], 0, False
    for line in iter(file.readline, b""):
        words = line.decode("utf-8", "replace").split()
        if words[:1] == ["format"] and words[1] != "binary_little_endian":
            raise ValueError(f"{path}: expected binary_little_endian, found {words[1]}")
        if words[:1] == ["element"]:
            is_vertex = words[1] == "vertex"
            n_rows = int(words[2]) if is_vertex else n_rows
        if words[:1] == ["property"] and is_vertex:
            if words[1] == "list":
                raise ValueError(f"{path}: expected one value of {words[-1]} for each surfel, found a list")
            fields.append((words[2], "<" + TYPES[words[1]]))
        if words == ["end_header"]:
            return numpy.dtype(fields), n_rows
    raise ValueError(f"{path}: expected end_header")
