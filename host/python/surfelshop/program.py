"""The program: where it is, and one run of it."""

import json
import os
import shutil
import subprocess


class SurfelshopError(RuntimeError):
    """A command failed. The text is the line that the program printed."""

    def __init__(self, line, code):
        super().__init__(line)
        #: The program's exit code: 1 where the work failed, 2 where the command line was not understood.
        self.code = code


def program():
    """The path of the program: what the variable SURFELSHOP names, else that in PATH."""
    named = os.environ.get("SURFELSHOP")
    found = named or shutil.which("surfelshop")
    if not found:
        raise SurfelshopError(
            "surfelshop: the program was not found; put it into PATH, or name it in the variable SURFELSHOP", 127
        )
    return found


def words(options):
    """Options as the command line takes them: `one_sided=True`, `size=(640, 480)`, `light=["0,1,0", "camera"]`."""
    typed = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            typed.append(option)
        elif isinstance(value, dict):
            for key, one in value.items():
                typed += [option, f"{key}={_text(one)}"]
        elif isinstance(value, list):
            for one in value:
                typed += [option, _text(one)]
        elif name == "size" and isinstance(value, tuple):
            typed += [option, "x".join(str(side) for side in value)]
        else:
            typed.append(f"{option}={_text(value)}")
    return typed


def _text(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return ",".join(_text(one) for one in value)
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)


def run(command, arguments):
    """Runs a command with --json and returns the object that it prints."""
    typed = [program(), command, *[_text(word) for word in arguments], "--json"]
    try:
        ended = subprocess.run(typed, capture_output=True, text=True, check=False)
    except OSError as error:
        raise SurfelshopError(f"surfelshop: {typed[0]}: {error.strerror}", 127) from error
    if ended.returncode != 0:
        lines = [line for line in ended.stderr.splitlines() if line.strip()]
        # A command line that was not understood is followed by the usage.
        line = (lines[0] if ended.returncode == 2 else lines[-1]) if lines else "surfelshop: it ended without a word"
        raise SurfelshopError(line, ended.returncode)
    return json.loads(ended.stdout)
