"""Load, bake, render, compare and report clouds of oriented discs, by the program surfelshop."""

from . import exr, ply
from .cloud import Cloud
from .commands import bake, compare, info, render, report
from .program import SurfelshopError, program, run
from .table import Table

__version__ = "0.1.0"

__all__ = [
    "Cloud",
    "SurfelshopError",
    "Table",
    "bake",
    "compare",
    "exr",
    "info",
    "ply",
    "program",
    "render",
    "report",
    "run",
]
