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
        elif name == "size" and isinstance(value, (tuple, list)):
            typed += [option, "x".join(str(side) for side in value)]
        elif isinstance(value, list):
            for one in value:
                typed += [option, _text(one)]
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
        raise SurfelshopError(_reason(ended.stderr, ended.returncode), ended.returncode)
    try:
        return json.loads(ended.stdout)
    except ValueError as error:
        raise SurfelshopError(f"surfelshop: {typed[0]}: expected an answer in JSON; is it the program surfelshop?", 127) from error


def _reason(said, code):
    """The line that says why a command failed."""
    if code == 2:
        # A command line that was not understood: what is wrong with it, a blank line, and the usage.
        said = said.strip().split("\n\n")[0]
        return " ".join(said.split()) or "surfelshop: it ended without a word"
    lines = [line for line in said.splitlines() if line.strip()]
    return lines[-1] if lines else "surfelshop: it ended without a word"


def refuse(command, options, names):
    """Refuses options whose results no function returns."""
    for name in names:
        if options.get(name) is not None:
            option = "--" + name.replace("_", "-")
            raise SurfelshopError(f"surfelshop: {option}: not in Python; type `surfelshop {command}` in a shell", 2)
