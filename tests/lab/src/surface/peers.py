"""Normals of other programs, for the clouds that `surfelshop-lab surface dump FOLDER` writes.

    python3 peers.py normals FOLDER     degrees without sides, and the share of right sides
    python3 peers.py speed POINTS...    processor seconds for points of a bumpy sphere

Needs numpy and open3d; pymeshlab where it is installed.
"""

import pathlib
import resource
import sys

import numpy as np


def seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


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
        for name, find in rows:
            try:
                rms, five, ten, right = scores(find(), truth)
            except ImportError:
                continue
            except RuntimeError as error:
                print(f"{path.stem:<24} {name:<16} failed: {error}")
                continue
            print(f"{path.stem:<24} {name:<16} {rms:6.2f} {five:6.1f} {ten:6.1f} {right:6.1f}")


def bumpy(count):
    random = np.random.default_rng(5)
    at = random.normal(size=(count, 3))
    at /= np.linalg.norm(at, axis=1)[:, None]
    bump = 0.1 * (np.sin(7 * at[:, 0]) * np.sin(7 * at[:, 1]) + 0.3 * np.cos(13 * at[:, 2]))
    return (at * (1 + bump)[:, None]).astype(np.float32)


def speed(sizes):
    for size in sizes:
        points = bumpy(size)
        rows = [("open3d normals", of_open3d), ("pymeshlab normals", of_pymeshlab)]
        if size <= 1_000_000:
            rows.append(("open3d oriented", lambda points: of_open3d(points, 16, True)))
        for name, find in rows:
            start = seconds()
            try:
                find(points)
            except ImportError:
                continue
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1000
            print(f"{size:>9} {name:<18} {seconds() - start:7.2f} s, peak {peak} MB of all so far")


if __name__ == "__main__":
    if sys.argv[1] == "normals":
        normals(sys.argv[2])
    else:
        speed([int(size) for size in sys.argv[2:]])
