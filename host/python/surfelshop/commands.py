"""The program's commands as functions. Files are a path or a list of paths; further options are those of the command
line, with `_` for `-`."""

import os
import statistics
import tempfile

import numpy

from . import exr
from .program import refuse, run, words
from .table import Table


def _files(files):
    named = files if isinstance(files, (list, tuple)) else [files]
    return [getattr(file, "path", file) for file in named]


def _set(parameters, to=None):
    prefix = f"{to}:" if to else ""
    return {prefix + name.replace("_", "-"): value for name, value in (parameters or {}).items()}


def info(files, full=False):
    """What is in files, without loading clouds whole unless `full`."""
    return run("info", [*_files(files), *words({"full": full})])


def bake(files, *tools, out, parameters=None, **options):
    """Runs tools over a cloud and writes what comes of it; returns what is known of it. `parameters` are those of the
    tools."""
    named = [word for tool in tools for word in ("-t", tool)]
    return run("bake", [*_files(files), *named, "-o", out, *words({"set": _set(parameters), **options})])


def render(files, renderer=None, layers=False, parameters=None, **options):
    """A picture in linear radiance: float32, rows x columns x (R, G, B, A), colour multiplied by alpha. With `layers` a
    dictionary of all channels instead, such as `depth.Z`."""
    refuse("render", options, ["path", "part", "out"])
    named = ["-r", renderer] if renderer else []
    if not layers and "output" not in options:
        options["output"] = "color"
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "picture.exr")
        run("render", [*_files(files), *named, "-o", out, *words({"set": _set(parameters), **options})])
        channels = exr.read(out)
    if layers or "R" not in channels:
        return channels
    return numpy.stack([channels[name] for name in "RGBA"], axis=-1)


def compare(files, renderers, reference=None, out=None, parameters=None, **options):
    """What renderers make of a scene, measured: the object of metrics.json. `renderers` are ids, or a dictionary of names
    and ids. Pictures and page stay where `out` is given."""
    refuse("compare", options, ["part"])
    renderers = [renderers] if isinstance(renderers, str) else renderers
    pairs = renderers.items() if isinstance(renderers, dict) else ((name, name) for name in renderers)
    named = [word for name, unit in pairs for word in ("-r", unit if name == unit else f"{name}={unit}")]
    with tempfile.TemporaryDirectory() as folder:
        asked = {"reference": reference, "set": _set(parameters), **options}
        return run("compare", [*_files(files), *named, "-o", out or folder, *words(asked)])


def report(files, renderer=None, tool=None, knobs=None, reference=None, reference_set=None, out=None,
           parameters=None, **options):
    """Error against time, a row for each value of each knob. `knobs` are lists of values by parameter. Page and plots stay
    where `out` is given, and a report that was interrupted goes on there."""
    refuse("report", options, ["part"])
    named = ["-r", renderer] if renderer else ["-t", tool] if tool else []
    listed = lambda values: tuple(values) if isinstance(values, (list, tuple, numpy.ndarray, range)) else (values,)
    turned = {name.replace("_", "-"): listed(values) for name, values in (knobs or {}).items()}
    with tempfile.TemporaryDirectory() as folder:
        asked = {
            "knob": turned, "reference": reference, "reference_set": _set(reference_set), "set": _set(parameters),
            **options,
        }
        told = run("report", [*_files(files), *named, "-o", out or folder, *words(asked)])
    return Table(_row(cell) for knob in told["knobs"] for cell in knob["cells"])


def _row(cell):
    median = lambda key: statistics.median_high([run[key] for run in cell["runs"]]) if cell["runs"] and all(
        run[key] is not None for run in cell["runs"]) else None
    row = {"knob": cell["knob"], "value": _number(cell["value"]), **dict(cell["errors"]), "noise": cell["noise"]}
    row.update(ms=median("wall_ms"), own_passes_ms=median("own_passes_ms"), cpu_ms=median("cpu_ms"))
    row.update(first_ms=cell["first_ms"], fault=cell["fault"])
    return row


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text
