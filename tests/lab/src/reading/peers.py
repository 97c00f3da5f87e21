"""What files of scans hold, by surfelshop and by the programs of their fields.

    python3 peers.py values SURFELSHOP FOLDER [--pdal COMMAND]   every file below FOLDER, a row each
    python3 peers.py speed SURFELSHOP FILE... [--pdal COMMAND]   CPU seconds and peak memory, five rounds in turns

Needs numpy and plyfile; laspy with lazrs, pye57, pypcd4, pcl_pcd2ply, CloudCompare and pdal are asked where they
are there. COMMAND is how pdal is called, such as "chroot ROOT pdal". Every program reads a file in a process of its
own, with 60 seconds and 4 GiB, since damaged files make some of them run for ever.
"""

import argparse
import json
import multiprocessing
import os
import pathlib
import resource
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile

import numpy as np

LIMIT_SECONDS = 60
LIMIT_BYTES = 4 << 30

# Names of one column in the programs, all in lower case.
SAME = {
    "colorred": "red", "colorgreen": "green", "colorblue": "blue",
    "cartesianx": "x", "cartesiany": "y", "cartesianz": "z",
    "number_of_returns": "n_returns", "numberofreturns": "n_returns",
    "returnnumber": "return_number",
    "point_source_id": "point_source", "pointsourceid": "point_source",
    "scan_angle_rank": "scan_angle", "scananglerank": "scan_angle",
    "gpstime": "gps_time", "userdata": "user_data",
    "columnindex": "column_index", "rowindex": "row_index",
    "scalar_intensity": "intensity", "scalar_scalar_field": "intensity",
    "normalx": "nx", "normaly": "ny", "normalz": "nz",
    "scandirectionflag": "scan_direction_flag", "edgeofflightline": "edge_of_flight_line",
}  # fmt: skip

# Columns of others that are bits of one of ours.
BITS = {
    "synthetic": ("class_flags", 0), "key_point": ("class_flags", 1), "withheld": ("class_flags", 2),
    "overlap": ("class_flags", 3), "scan_direction_flag": ("scan_flags", 0), "edge_of_flight_line": ("scan_flags", 1),
}  # fmt: skip


def limits():
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_SECONDS, LIMIT_SECONDS))


def timed(command):
    """Runs a command: exit status, what it said, CPU seconds, peak MB."""
    with tempfile.NamedTemporaryFile("r") as out:
        run = subprocess.run(
            ["/usr/bin/time", "-f", "%U %S %M", "-o", out.name, *command],
            capture_output=True, text=True, preexec_fn=limits, timeout=4 * LIMIT_SECONDS,
        )  # fmt: skip
        user, system, kilobytes = out.read().strip().splitlines()[-1].split()
    said = (run.stderr + run.stdout).strip()
    return run.returncode, said, float(user) + float(system), int(kilobytes) / 1000


def ply(path):
    from plyfile import PlyData

    rows = PlyData.read(str(path))["vertex"].data
    return {name.lower(): np.asarray(rows[name]) for name in rows.dtype.names}


def packed(columns):
    """PCD's colour of one number, as three."""
    for name in ("rgb", "rgba"):
        if name in columns:
            bits = np.ascontiguousarray(columns.pop(name)).view(np.uint32)
            columns |= {"red": bits >> 16 & 255, "green": bits >> 8 & 255, "blue": bits & 255}
    return columns


def by_laspy(path, folder):
    import laspy

    points = laspy.read(path)
    names = [name for name in points.point_format.dimension_names if name not in "XYZ"]
    return {axis: np.asarray(points[axis]) for axis in "xyz"} | {name.lower(): np.asarray(points[name]) for name in names}


def by_pye57(path, folder):
    import pye57

    file = pye57.E57(str(path))
    ask = dict(intensity=True, colors=True, row_column=True, ignore_missing_fields=True)
    scans = [file.read_scan(at, **ask) for at in range(file.scan_count)]
    names = sorted({name for scan in scans for name in scan})
    return {name.lower(): np.concatenate([scan.get(name, np.zeros(0)) for scan in scans]) for name in names}


def by_pypcd4(path, folder):
    from pypcd4 import PointCloud

    points = PointCloud.from_path(path)
    return packed({name.lower(): points.pc_data[name] for name in points.fields})


def converted(command, out, name="PLY"):
    if shutil.which(command[0]) is None:
        raise ImportError(command[0])
    run = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"QT_QPA_PLATFORM": "offscreen"})
    if not out.exists():
        said = (run.stderr + run.stdout).strip().splitlines()
        raise ValueError(said[-1][:120] if said else f"no file, status {run.returncode}")
    return packed(ply(out))


def by_pcl(path, folder):
    out = folder / "pcl.ply"
    return converted(["pcl_pcd2ply", "-format", "1", "-use_camera", "0", str(path), str(out)], out)


def by_cloudcompare(path, folder):
    out = folder / "cloudcompare.ply"
    join = "-MERGE_CLOUDS" if path.suffix == ".ptx" else "-NO_TIMESTAMP"
    command = "CloudCompare -SILENT -AUTO_SAVE OFF -C_EXPORT_FMT PLY -PLY_EXPORT_FMT BINARY_LE -O -GLOBAL_SHIFT 0 0 0"
    return converted([*command.split(), str(path), join, "-SAVE_CLOUDS", "FILE", str(out)], out)


def by_plyfile(path, folder):
    return ply(path)


def by_numpy(path, folder):
    """PTS and PTX from their texts: lines of numbers; a scan of PTX starts with two sizes and a pose."""
    rows = [line.split() for line in path.read_text(errors="replace").splitlines()]
    parts, at = [], 0
    if path.suffix == ".pts":
        parts = [np.array([row for row in rows if len(row) > 2], float)]
    while path.suffix == ".ptx" and at < len(rows) and rows[at]:
        count = int(rows[at][0]) * int(rows[at + 1][0])
        pose = np.array(rows[at + 6 : at + 10], float)
        scan = np.array(rows[at + 10 : at + 10 + count], float)
        scan = scan[(scan[:, :3] != 0).any(axis=1)]
        scan[:, :3] = (np.c_[scan[:, :3], np.ones(len(scan))] @ pose)[:, :3]
        parts.append(scan)
        at += 10 + count
    names = ["x", "y", "z", "intensity", "red", "green", "blue"]
    return dict(zip(names, np.concatenate(parts).T, strict=False))


def by_pdal(path, folder, command):
    out = folder / "pdal.ply"
    return converted([*command, "translate", str(path), str(out), "--writers.ply.storage_mode=little endian"], out)


READERS = {
    ".las": [("laspy", by_laspy)],
    ".laz": [("laspy", by_laspy)],
    ".e57": [("pye57", by_pye57)],
    ".pcd": [("pypcd4", by_pypcd4), ("PCL", by_pcl)],
    ".pts": [("numpy", by_numpy), ("CloudCompare", by_cloudcompare)],
    ".ptx": [("numpy", by_numpy), ("CloudCompare", by_cloudcompare)],
    ".ply": [("plyfile", by_plyfile), ("CloudCompare", by_cloudcompare)],
}


def apart(reader, path, folder):
    """Reads in a process of its own and returns columns, or a line that says why there are none."""

    def child(pipe):
        limits()
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES))
        try:
            answer = reader(path, folder)
        except ImportError as error:
            answer = None if getattr(error, "name", None) or shutil.which(str(error)) is None else str(error)
        except BaseException as error:
            answer = " ".join(str(error).split())[:120] or type(error).__name__
        pipe.send(answer)

    here, there = multiprocessing.Pipe(False)
    process = multiprocessing.get_context("fork").Process(target=child, args=(there,))
    process.start()
    there.close()
    try:
        answer = here.recv() if here.poll(LIMIT_SECONDS) else f"no answer after {LIMIT_SECONDS} s"
    except EOFError:
        answer = "ends without an answer"
    process.kill()
    process.join()
    return answer


def differences(ours, theirs):
    """Both are columns by name: what is equal, and a phrase for whatever is not."""
    ours, theirs = ({SAME.get(name, name): values for name, values in side.items()} for side in (ours, theirs))
    if not {"x", "y", "z"} <= set(theirs):
        return ["NO COORDINATES"], 0
    phrases, equal = [], 0
    finite = np.isfinite(np.stack([np.asarray(theirs[axis], float) for axis in "xyz"])).all(axis=0)
    if not finite.all():
        phrases.append(f"{(~finite).sum()} of its places are not finite")
    ours_n, theirs_n = len(ours["x"]), int(finite.sum())
    if ours_n != theirs_n:
        return [*phrases, f"COUNT {theirs_n}"], equal
    for name in sorted(theirs):
        there = np.asarray(theirs[name], float)
        there = there[finite] if len(there) == len(finite) else there
        of, bit = BITS.get(name, (None, 0))
        if name in ours:
            here = np.asarray(ours[name], float)
        elif of in ours:
            here = (np.asarray(ours[of]).astype(int) >> bit) & 1
        else:
            if len(there) and not (there == there[0]).all():
                phrases.append(f"{name} is not ours")
            continue
        if len(here) == len(there) and np.array_equal(here, there, equal_nan=True):
            equal += 1
        elif len(here) == len(there):
            phrases.append(f"{name} differs by {np.nanmax(np.abs(here - there)):.2g}")
        else:
            phrases.append(f"{name} has {len(there)} values")
    return phrases, equal


def values(shop, data, pdal):
    print("| file | points | CPU s, MB | equal columns, differences |\n|---|---|---|---|")
    known = set(READERS)
    for path in sorted(path for path in data.rglob("*") if path.suffix in known and path.is_file()):
        with tempfile.TemporaryDirectory() as made:
            folder = pathlib.Path(made)
            out = folder / "ours.ply"
            status, said, seconds, megabytes = timed([shop, "convert", str(path), str(out)])
            ours = ply(out) if status == 0 else None
            cells = []
            if ours is None:
                cells.append("refused: " + said.splitlines()[-1].split(f"{path}: ")[-1])
            else:
                cells += bounds(shop, path, ours)
            asked = list(READERS[path.suffix])
            if pdal and path.suffix not in (".e57", ".ptx"):
                asked.append(("PDAL", lambda path, folder: by_pdal(path, folder, pdal)))
            for who, reader in asked:
                answer = apart(reader, path, folder)
                if answer is None:
                    continue
                if isinstance(answer, str):
                    cells.append(f"{who}: refuses ({answer})")
                elif ours is None:
                    cells.append(f"{who}: {len(next(iter(answer.values()), []))} points")
                else:
                    phrases, equal = differences(ours, answer)
                    cells.append(f"{who}: {equal}" + "".join(", " + phrase for phrase in phrases))
            count = "" if ours is None else f"{len(ours['x']):,}"
            row = "; ".join(cells).replace("|", "/")
            print(f"| {path.relative_to(data)} | {count} | {seconds:.2f}, {megabytes:.0f} | {row} |", flush=True)


def bounds(shop, path, ours):
    """What `info` says without reading the points, against what was read."""
    run = subprocess.run([shop, "info", str(path), "--json"], capture_output=True, text=True)
    if run.returncode:
        return [f"INFO REFUSES: {run.stderr.strip()}"]
    cloud = json.loads(run.stdout)["clouds"][0]
    cells = []
    if cloud["n_points"] != len(ours["x"]):
        cells.append(f"info says {cloud['n_points']:,} places")
    if len(ours["x"]) and cloud.get("bounds"):
        read = np.array([[ours[axis].min() for axis in "xyz"], [ours[axis].max() for axis in "xyz"]], float)
        off = np.abs(np.array(cloud["bounds"], float) - read).max()
        if off > 0:
            cells.append(f"bounds in its head differ by {off:.2g}")
    return cells


LASPY = "import laspy, sys; laspy.read(sys.argv[1]).write(sys.argv[2])"
PYE57 = """import pye57, sys
file = pye57.E57(sys.argv[1])
out = pye57.E57(sys.argv[2], mode="w")
for at in range(file.scan_count):
    ask = dict(intensity=True, colors=True, ignore_missing_fields=True)
    out.write_scan_raw(file.read_scan(at, transform=False, **ask))
"""


def speed(shop, files, pdal):
    """Reads each file and writes it again, LAZ as LAS, by every program in turns."""
    with tempfile.TemporaryDirectory() as made:
        jobs = {}
        for path in files:
            ending = ".las" if path.suffix == ".laz" else path.suffix
            out = str(pathlib.Path(made) / ("out" + ending))
            name = f"{path.name} to {ending}"
            jobs[name, "surfelshop"] = [shop, "convert", str(path), out]
            if path.suffix in (".las", ".laz"):
                jobs[name, "laspy"] = [sys.executable, "-c", LASPY, str(path), out]
                if pdal:
                    forward = "--writers.las.forward=all"
                    jobs[name, "PDAL, streamed"] = [*pdal, "translate", "--stream", str(path), out, forward]
            if path.suffix == ".e57":
                jobs[name, "pye57"] = [sys.executable, "-c", PYE57, str(path), out]
            jobs[name, "plain copy"] = ["cp", str(path), out]
        costs = {job: [] for job in jobs}
        for _ in range(5):
            for job, command in jobs.items():
                for old in pathlib.Path(made).glob("out*"):
                    old.unlink()
                status, said, seconds, megabytes = timed(command)
                if status:
                    sys.exit(f"{job}: {said}")
                costs[job].append((seconds, megabytes))
    print("| what | program | CPU s, median (least to most) | peak MB |\n|---|---|---|---|")
    for (name, who), cost in costs.items():
        seconds = [second for second, _ in cost]
        spread = f"{statistics.median(seconds):.2f} ({min(seconds):.2f} to {max(seconds):.2f})"
        print(f"| {name} | {who} | {spread} | {max(megabytes for _, megabytes in cost):.0f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["values", "speed"])
    parser.add_argument("surfelshop")
    parser.add_argument("paths", nargs="+", type=pathlib.Path)
    parser.add_argument("--pdal", type=shlex.split, default=["pdal"] if shutil.which("pdal") else None)
    said = parser.parse_args()
    if said.what == "values":
        for folder in said.paths:
            values(said.surfelshop, folder, said.pdal)
    else:
        speed(said.surfelshop, said.paths, said.pdal)


if __name__ == "__main__":
    main()
