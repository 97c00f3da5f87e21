"""A cloud in a file, with what can be done to it."""

import os
import tempfile

from . import commands, ply
from .program import run, words


class Cloud:
    """A cloud or a scene in a file, which the program reads whenever it works on it."""

    def __init__(self, path, _folder=None):
        self.path = os.fspath(path)
        # A folder that goes when nobody has the cloud any more.
        self._folder = _folder

    def __repr__(self):
        return f"surfelshop.Cloud({self.path!r})"

    def info(self, full=False):
        """What is in the file."""
        return commands.info(self.path, full=full)

    def columns(self, estimate=False):
        """The columns as arrays; with `estimate` the normals and radii that the file lacks, too."""
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "cloud.ply")
            run("convert", [self.path, out, *words({"estimate": estimate})])
            return ply.read(out)

    def bake(self, *tools, out=None, **parameters):
        """Another cloud, made of this one by tools with these parameters. Without `out` its file goes with it."""
        folder = None
        if out is None:
            folder = tempfile.TemporaryDirectory()
            out = os.path.join(folder.name, "baked.ply")
        commands.bake(self.path, *tools, out=out, parameters=parameters)
        return Cloud(out, folder)

    def render(self, renderer=None, **options):
        """A picture; see `surfelshop.render`."""
        return commands.render(self.path, renderer, **options)

    def compare(self, renderers, **options):
        """What renderers make of it; see `surfelshop.compare`."""
        return commands.compare(self.path, renderers, **options)

    def report(self, renderer=None, **options):
        """Error against time; see `surfelshop.report`."""
        return commands.report(self.path, renderer, **options)
