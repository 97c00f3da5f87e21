"""Normals of other programs, for the clouds that `surfelshop-lab surface dump FOLDER` writes.

    python3 peers.py normals FOLDER     degrees without sides, and the share of right sides
    python3 peers.py speed POINTS...    processor seconds for points of a bumpy sphere, in turn, three times each up to 1 M
    python3 peers.py icp SURFELSHOP MODEL...  halves of models, moved and put onto each other again

Needs numpy and open3d; pymeshlab, PCL's tools, CloudCompare, `jets` (see jets.cpp) and `surfelshop-lab` where they are
installed.
"""

import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import traceback

import numpy as np


def seconds():
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def run(*words):
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    subprocess.run(words, check=True, capture_output=True, env=environment)


def installed(program):
    if shutil.which(program) is None:
        raise ImportError(program)


def of_open3d(points, k=16, orient=False):
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.astype(np.float64)))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(k + 1))
    if orient:
        cloud.orient_normals_consistent_tangent_plane(k)
    return np.asarray(cloud.normals)


def of_pymeshlab(points, k=16):
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points.astype(np.float64)))
    meshes.compute_normal_for_point_clouds(k=k, smoothiter=0)
    return meshes.current_mesh().vertex_normal_matrix()


def write_pcd(path, points):
    head = f"""VERSION 0.7
FIELDS x y z
SIZE 4 4 4
TYPE F F F
COUNT 1 1 1
WIDTH {len(points)}
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS {len(points)}
DATA binary
"""
    path.write_bytes(head.encode() + points.astype("<f4").tobytes())


def of_pcl(points, k=16):
    """With its reading and writing, which is little of it."""
    installed("pcl_normal_estimation")
    with tempfile.TemporaryDirectory() as folder:
        given, found, plain = (pathlib.Path(folder) / f"{name}.pcd" for name in "abc")
        write_pcd(given, points)
        run("pcl_normal_estimation", given, found, "-k", str(k + 1))
        run("pcl_convert_pcd_ascii_binary", found, plain, "1")
        data = plain.read_bytes()
        start = data.index(b"DATA binary\n") + len(b"DATA binary\n")
        return np.frombuffer(data, "<f4", 7 * len(points), start).reshape(len(points), 7)[:, :3]


def of_cloudcompare(points, k=16):
    """Planes in balls that hold about so many points; with its reading, and its writing as text."""
    installed("CloudCompare")
    import open3d as o3d

    tree = o3d.geometry.KDTreeFlann(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.astype(np.float64))))
    some = points[:: max(1, len(points) // 1000)].astype(np.float64)
    radius = np.median([np.sqrt(tree.search_knn_vector_3d(point, k + 1)[2][-1]) for point in some])
    with tempfile.TemporaryDirectory() as folder:
        given, found = pathlib.Path(folder) / "a.ply", pathlib.Path(folder) / "b.txt"
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        axes = "".join(f"property float {axis}\n" for axis in "xyz")
        given.write_bytes(f"{head}{axes}end_header\n".encode() + points.astype("<f4").tobytes())
        options = ["-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", "ASC", "-PREC", "7", "-NO_TIMESTAMP"]
        words = ["-O", given, "-OCTREE_NORMALS", f"{radius:.9g}", "-SAVE_CLOUDS", "FILE", found]
        run("CloudCompare", *options, *words)
        return np.loadtxt(found, usecols=(3, 4, 5))


def of_cgal(points, k=16):
    """Jets of degree 2, beside which CGAL has fits of planes."""
    installed("jets")
    done = subprocess.run(["jets", str(k + 1)], input=points.astype("<f4").tobytes(), check=True, capture_output=True)
    return np.frombuffer(done.stdout, "<f4").reshape(-1, 3)


def scores(found, truth):
    cosine = np.sum(found * truth, axis=1)
    degrees = np.degrees(np.arccos(np.clip(np.abs(cosine), 0, 1)))
    within = [100 * np.mean(degrees < limit) for limit in (5, 10)]
    return np.sqrt(np.mean(degrees**2)), *within, 100 * np.mean(cosine > 0)


def normals(folder):
    for path in sorted(pathlib.Path(folder).glob("*.bin")):
        data = np.fromfile(path, dtype="<f4").reshape(-1, 6)
        points, truth = data[:, :3], data[:, 3:]
        rows = [(f"open3d k={k}", lambda k=k: of_open3d(points, k)) for k in (16, 64, 256)]
        rows.append(("open3d oriented", lambda: of_open3d(points, 16, True)))
        rows.append(("pymeshlab k=16", lambda: of_pymeshlab(points)))
        rows.extend((f"PCL k={k}", lambda k=k: of_pcl(points, k)) for k in (16, 64))
        rows.append(("CloudCompare", lambda: of_cloudcompare(points)))
        rows.extend((f"CGAL k={k}", lambda k=k: of_cgal(points, k)) for k in (17, 63, 255))
        for name, find in rows:
            try:
                rms, five, ten, right = scores(find(), truth)
            except ImportError:
                continue
            except (RuntimeError, subprocess.CalledProcessError, OSError) as error:
                print(f"{path.stem:<24} {name:<16} failed: {error}")
                continue
            print(f"{path.stem:<24} {name:<16} {rms:6.2f} {five:6.1f} {ten:6.1f} {right:6.1f}")


def bumpy(count):
    random = np.random.default_rng(5)
    at = random.normal(size=(count, 3))
    at /= np.linalg.norm(at, axis=1)[:, None]
    bump = 0.1 * (np.sin(7 * at[:, 0]) * np.sin(7 * at[:, 1]) + 0.3 * np.cos(13 * at[:, 2]))
    return (at * (1 + bump)[:, None]).astype(np.float32)


def rounds(size):
    return 3 if size <= 1_000_000 else 1


def of_surfelshop(size):
    """Processor seconds of normals and radii, and the most memory, MB, sides included: as the lab says, whose points are its own."""
    installed("surfelshop-lab")
    done = subprocess.run(["surfelshop-lab", "surface", "speed", str(size)], check=True, capture_output=True, text=True)
    time = float(re.search(r"all but sides ([0-9.]+)", done.stdout)[1])
    peaks = re.search(r"peaks ([0-9, ]+) MB", done.stdout)[1].split(",")
    return time, max(map(int, peaks))


def once(find, points):
    """Processor seconds and the most memory, MB, of a program of its own: its points and Python are in it."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            start = seconds()
            find(points)
            peak = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
            os.write(write, f"{seconds() - start} {peak // 1000}".encode())
        except ImportError:
            pass
        except Exception:
            traceback.print_exc()
        finally:
            os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        said = pipe.read().split()
    os.waitpid(child, 0)
    if not said:
        raise ImportError(find)
    return float(said[0]), int(said[1])


def speed(sizes):
    for size in sizes:
        points = bumpy(size)
        programs = {
            "open3d": of_open3d,
            "pymeshlab": of_pymeshlab,
            "PCL": of_pcl,
            "CGAL jets": of_cgal,
        }
        if size <= 1_000_000:
            programs["open3d oriented"] = lambda points: of_open3d(points, 16, True)
            programs["CloudCompare"] = of_cloudcompare
        found = {}
        for _ in range(rounds(size)):
            for name, find in [("surfelshop", None), *programs.items()]:
                try:
                    one = of_surfelshop(size) if find is None else once(find, points)
                except ImportError:
                    continue
                found.setdefault(name, []).append(one)
        for name, measured in found.items():
            times = sorted(time for time, _ in measured)
            peak = max(peak for _, peak in measured)
            print(f"{size:>9} {name:<16} {times[len(times) // 2]:7.2f} s ({times[0]:.2f} to {times[-1]:.2f}), {peak} MB")


def write_surfels(path, points, normals, radius):
    names = ["x", "y", "z", "nx", "ny", "nz", "radius"]
    head = "".join(f"property float {name}\n" for name in names)
    rows = np.hstack([points, normals, np.full((len(points), 1), radius)]).astype("<f4")
    text = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{head}end_header\n"
    path.write_bytes(text.encode() + rows.tobytes())


def read_moved(path, count):
    raw = path.read_bytes()
    head, body = raw.split(b"end_header\n", 1)
    lines = head.decode().split("\n")
    types = {"float": "<f4", "double": "<f8", "uchar": "u1", "uint8": "u1", "float32": "<f4", "float64": "<f8"}
    fields = [line.split()[1:] for line in lines if line.startswith("property")]
    rows = np.frombuffer(body, [(name, types[kind]) for kind, name in fields], count)
    return np.stack([rows[axis] for axis in "xyz"], 1).astype(np.float64)


def icp(program, models):
    import open3d as o3d

    random = np.random.default_rng(7)
    for model in map(pathlib.Path, models):
        mesh = o3d.io.read_triangle_mesh(str(model))
        if len(mesh.triangles) > 0:
            mesh.compute_vertex_normals()
            points, normals = np.asarray(mesh.vertices), np.asarray(mesh.vertex_normals)
        else:
            cloud = o3d.io.read_point_cloud(str(model))
            cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(17))
            cloud.orient_normals_consistent_tangent_plane(16)
            points, normals = np.asarray(cloud.points), np.asarray(cloud.normals)
        order = random.permutation(len(points))
        halves = [np.sort(order[part::2]) for part in range(2)]
        whole = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points[halves[0]]))
        spacing = float(np.median(whole.compute_nearest_neighbor_distance()))
        first, second = (points[half] + random.normal(scale=0.2 * spacing, size=(len(half), 3)) for half in halves)
        turn = o3d.geometry.get_rotation_matrix_from_xyz(np.radians([8.0, 15.0, 0.0]))
        middle = points.mean(0)
        moved, turned = (second - middle) @ turn.T + middle, normals[halves[1]] @ turn.T
        rms = lambda found: float(np.sqrt(((found - second) ** 2).sum(1).mean()))
        # One beside the other, three times each.
        ours, theirs = [], []
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            write_surfels(folder / "first.ply", first, normals[halves[0]], 1.5 * spacing)
            write_surfels(folder / "second.ply", moved, turned, 1.5 * spacing)
            words = [program, "bake", "second.ply", "-t", "register", "--set", "to=first.ply", "-o", "moved.ply"]
            for _ in range(3):
                done = subprocess.run(words, check=True, capture_output=True, text=True, cwd=folder)
                ours.append([line for line in (done.stdout + done.stderr).splitlines() if "RMS" in line][0])
                clouds = []
                for places, facing in [(moved, turned), (first, normals[halves[0]])]:
                    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(places))
                    cloud.normals = o3d.utility.Vector3dVector(facing)
                    clouds.append(cloud)
                start = seconds()
                found = o3d.pipelines.registration.registration_icp(
                    *clouds, 3 * spacing, np.eye(4),
                    o3d.pipelines.registration.TransformationEstimationPointToPlane(),
                    o3d.pipelines.registration.ICPConvergenceCriteria(1e-9, 1e-9, 200),
                )
                theirs.append(seconds() - start)
            own = rms(read_moved(folder / "moved.ply", len(moved)))
        other = rms(np.asarray(clouds[0].transform(found.transformation).points))
        print(f"{model.stem}: {len(moved)} points, {spacing:.2e} apart; {own:.2e}, open3d {other:.2e}")
        print("  " + "\n  ".join(line[-60:] for line in ours))
        print("  open3d: " + ", ".join(f"{time:.2f} s" for time in theirs))


if __name__ == "__main__":
    if sys.argv[1] == "icp":
        icp(sys.argv[2], sys.argv[3:])
    elif sys.argv[1] == "normals":
        normals(sys.argv[2])
    else:
        speed([int(size) for size in sys.argv[2:]])
