"""Time reductions, on one thread and with their accuracy beside them, against programs that do the same.

The peers are in benchmarks/requirements-peers.txt; one that is not installed is reported and omitted. Every
benchmark is a function in `BENCHMARKS`; name some on the command line to run those alone.
"""

import importlib
import os
import resource
import sys
import time

import numpy as np
from figures import Figure, Target, tell

from a7sim.geometry import image_of, mxm, rotation, transposed, turn_of
from a7sim.reduction.coplanarity import coplanarity, rays_of, relative_orientation
from a7sim.reduction.relative_poses import relative_poses
from a7sim.reduction.similarity import similarity_by_iteration, similarity_by_quaternion

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
C = 152.0
BASE = 92.0
NOISE = 0.005
TILT = np.radians(1.5)
POINTS = (6, 9, 15, 100)
BLOCK = 20_000
MANY = 1_000_000
ROUNDS = 9
TIMES_POSELIB = 10
ONE_PAIR_US = 300
ASKED_POINTS = (6, 9, 15)
"""Points of the pairs with a target."""

TARGETS = {
    "batch": Target("at least", TIMES_POSELIB, "ratio"),
    "one pair": Target("below", ONE_PAIR_US),
    "memory": Target("below", 300),
    "similarity": Target("at least", 4, "ratio"),
}
AIR_TO_VISION = np.diag([1.0, -1.0, -1.0])
"""Photogrammetry's camera looks along -z with y up, computer vision's along +z with y down."""


def peer(module):
    """Return the module, or None with a message."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        print(f"  {module}: not installed here ({error}); see benchmarks/requirements-peers.txt")
        return None


def best_time(call, rounds=ROUNDS):
    """Return the shortest of several rounds, in seconds, which other work disturbs least."""
    took = []
    for _ in range(rounds):
        began = time.perf_counter()
        call()
        took.append(time.perf_counter() - began)
    return min(took)


def plan_of(n, rng):
    """Return points of the model in bases: Gruber's six, rows of three and five, or scattered; 60 % overlap."""
    columns = {6: 2, 9: 3, 15: 5}.get(n)
    if columns is None:
        return rng.uniform((0.0, -1.0), (1.0, 1.0), (n, 2)).T
    return np.array([(x, y) for y in (0.0, 1.0, -1.0) for x in np.linspace(0.0, 1.0, columns)]).T


def pairs(rng, n, count):
    """Return images ``(2, n, count)`` of both photographs of near-vertical pairs, with errors of measurement."""
    plan = plan_of(n, rng)[:, :, None] * BASE
    points = np.concatenate([np.broadcast_to(plan, (2, n, count)), -C * rng.uniform(0.95, 1.05, (1, n, count))])
    images = []
    for centre in ((0.0, 0.0, 0.0), (BASE, 0.0, 0.0)):
        turn = rotation(*rng.uniform(-TILT, TILT, (3, count)))
        image = image_of(points, np.reshape(centre, (3, 1, 1)), turn[:, :, None], C)
        images.append(image + NOISE * rng.standard_normal(image.shape))
    return images


def rms_parallax_um(image1, image2, turns, bases):
    """Return the rms of the residual y-parallaxes of poses at picture scale, the same for all programs."""
    level = np.broadcast_to(np.eye(3)[:, :, None], turns.shape)
    condition = coplanarity(rays_of(image1, C), rays_of(image2, C), level, turns, bases)
    return 1000.0 * np.sqrt(2.0 * np.mean((condition.discrepancies / condition.steepness) ** 2))


def relative():
    """Relative orientation from zero: batched compared with one call per pair."""
    poselib, pycolmap = peer("poselib"), peer("pycolmap")
    print("relative orientation, 5 um image noise, c = 152 mm, 60 % overlap, tilts to 1.5 deg, from zero")
    print(
        f"targets: {TIMES_POSELIB} times poselib batched at 6 to 15 points, {ONE_PAIR_US} us for one pair called alone"
    )
    print(
        "points  program             us/pair   pairs/s  iterations  rms parallax um  theory um  times poselib  goal us"
    )
    figures = []
    for n in POINTS:
        rng = np.random.default_rng(n)
        theory = 1000.0 * NOISE * np.sqrt(2.0 * (n - 5) / n)
        count = BLOCK if n < 50 else BLOCK // 10
        image1, image2 = pairs(rng, n, count)
        rows = []
        poses = relative_poses(image1, image2, C, C)
        took = best_time(lambda a=image1, b=image2: relative_poses(a, b, C, C)) / count
        rms = rms_parallax_um(image1, image2, poses.rotation, poses.base)
        rows.append(("a7sim batch", took, poses.iterations.mean(), rms))
        a, b = image1[..., 0].copy(), image2[..., 0].copy()
        for label, call in (("a7sim one pair", relative_poses), ("  with statistics", relative_orientation)):
            took = best_time(lambda a=a, b=b, call=call: [call(a, b, C, C) for _ in range(100)], 10) / 100.0
            rows.append((label, took, np.nan, np.nan))
        if poselib:
            rows.append(("poselib", *_by_poselib(poselib, image1, image2)))
        if pycolmap:
            rows.append(("pycolmap", *_by_pycolmap(pycolmap, image1[..., :300], image2[..., :300])))
        base_line = next((took for label, took, *_ in rows if label == "poselib"), np.nan)
        figures += relative_figures(n, {label: took for label, took, *_ in rows}, theory, rows[0][3])
        for label, took, iterations, rms in rows:
            speed = f"{1e6 * took:9.2f}{1.0 / took:10.0f}{iterations:12.2f}"
            if label == "a7sim batch":
                ours = f"{base_line / took:15.1f}{1e6 * base_line / TIMES_POSELIB:11.2f}"
            else:
                ours = f"{ONE_PAIR_US:26}" if label == "a7sim one pair" else ""
            print(f"{n:6}  {label:18}{speed}{rms:17.3f}{theory:11.3f}{ours}")
    return [*figures, _many()]


def relative_figures(n, took, theory, rms):
    """Return the time per pair of n points of each program, and our rms compared with theory."""
    name, ours = f"relative orientation, {n} points", took["a7sim batch"]
    asked = TARGETS if n in ASKED_POINTS else {}
    times = {peer: took[peer] / ours if peer in took else None for peer in ("poselib", "pycolmap")}
    return [
        Figure(f"{name}, a pair of many", 1e6 * ours, "us", "poselib", times["poselib"], asked.get("batch")),
        Figure(f"{name}, a pair of many", 1e6 * ours, "us", "pycolmap", times["pycolmap"]),
        Figure(f"{name}, one pair alone", 1e6 * took["a7sim one pair"], "us", target=asked.get("one pair")),
        Figure(f"{name}, rms parallax", rms, "um", "theory", rms / theory),
    ]


def _many():
    """A million pairs in blocks: memory."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    rng = np.random.default_rng(1)
    took, oriented, squares = 0.0, 0, 0.0
    for _ in range(MANY // BLOCK):
        image1, image2 = pairs(rng, 6, BLOCK)
        began = time.perf_counter()
        poses = relative_poses(image1, image2, C, C)
        took += time.perf_counter() - began
        oriented += int(poses.converged.sum())
        squares += float((poses.s0**2).sum())
    whole = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(
        f"{MANY} pairs of 6 points in blocks of {BLOCK}: {took:.1f} s, {oriented} oriented, "
        f"s0 {1000.0 * np.sqrt(squares / MANY):.3f} um, peak memory {whole / 1024.0:.0f} MB "
        f"({(whole - before) / 1024.0:.0f} MB more than before)"
    )
    return Figure(f"memory of {MANY} pairs in blocks", whole / 1024.0, "MB", target=TARGETS["memory"])


def _by_poselib(poselib, image1, image2):
    lefts, rights = (_seen(image) for image in (image1, image2))
    camera = poselib.Camera("SIMPLE_PINHOLE", [C, 0.0, 0.0], 230, 230)
    start = poselib.CameraPose()
    start.t = np.array([-1.0, 0.0, 0.0])
    found = []

    def orient():
        found[:] = [
            poselib.refine_relative_pose(a, b, start, camera, camera) for a, b in zip(lefts, rights, strict=True)
        ]

    took = best_time(orient) / len(lefts)
    turns = np.stack([pose.R for pose, _ in found], axis=-1)
    shifts = np.stack([pose.t for pose, _ in found], axis=-1)
    iterations = np.mean([report["iterations"] for _, report in found])
    return took, iterations, rms_parallax_um(image1, image2, *_from_vision(turns, shifts))


def _by_pycolmap(pycolmap, image1, image2):
    lefts, rights = (_seen(image) for image in (image1, image2))
    camera = pycolmap.Camera(model="SIMPLE_PINHOLE", width=230, height=230, params=[C, 0.0, 0.0])
    all_points = np.ones(image1.shape[1], dtype=bool)
    found = []

    def orient():
        found.clear()
        for a, b in zip(lefts, rights, strict=True):
            start = pycolmap.Rigid3d(pycolmap.Rotation3d(np.eye(3)), np.array([-1.0, 0.0, 0.0]))
            found.append(pycolmap.refine_relative_pose(start, camera, a, camera, b, all_points)["cam2_from_cam1"])

    took = best_time(orient, 3) / len(lefts)
    turns = np.stack([pose.rotation.matrix() for pose in found], axis=-1)
    shifts = np.stack([pose.translation for pose in found], axis=-1)
    return took, np.nan, rms_parallax_um(image1, image2, *_from_vision(turns, shifts))


def _seen(image):
    """Return image points in the convention of computer vision, a list of arrays ``(n, 2)``."""
    return [np.ascontiguousarray((image[..., i] * [[1.0], [-1.0]]).T) for i in range(image.shape[-1])]


def _from_vision(turns, shifts):
    """Return rotation right to left and base, in the left photograph's frame, from x2 = R x1 + t of computer vision."""
    back = transposed(turns)
    turned = np.einsum("ij,jk...,kl->il...", AIR_TO_VISION, back, AIR_TO_VISION)
    return turned, np.einsum("ij,jk...,k...->i...", AIR_TO_VISION, back, -shifts)


def similarity():
    """Similarity of models of six points to the ground: batched compared with one call per model."""
    pycolmap = peer("pycolmap")
    rng = np.random.default_rng(6)
    sigma, count = 0.02, BLOCK
    models = BASE * rng.uniform(-1.0, 1.0, (3, 6, count))
    scales, turns = rng.uniform(0.5, 2.0, count), rotation(*rng.uniform(-0.5, 0.5, (3, count)))
    shifts = rng.uniform(-1000.0, 1000.0, (3, count))
    targets = scales * np.einsum("ij...,jn...->in...", turns, models) + shifts[:, None]
    targets = targets + sigma * rng.standard_normal(targets.shape)
    rows = []
    for label, call in (("a7sim closed form", similarity_by_quaternion), ("a7sim iterated", similarity_by_iteration)):
        found = call(models, targets)
        took = best_time(lambda call=call: call(models, targets), 3) / count
        rows.append((label, took, found.scale, found.rotation, found.translation))
        a, b = models[..., 0].copy(), targets[..., 0].copy()
        took = best_time(lambda a=a, b=b, call=call: [call(a, b) for _ in range(100)]) / 100.0
        rows.append(("  one model", took, None, None, None))
    if pycolmap:
        rows.append(("pycolmap", *_similarity_by_pycolmap(pycolmap, models, targets)))
    peers = next((took for label, took, *_ in rows if label == "pycolmap"), np.nan)
    print(f"similarity, 6 points, errors of {sigma} in each coordinate; the closed form is to be 4 times pycolmap")
    print("program             us/model  models/s  rms residual  theory  rms turn from truth mgon  times pycolmap")
    for label, took, scale, turn, shift in rows:
        speed = f"{label:18}{1e6 * took:10.2f}{1.0 / took:10.0f}"
        if scale is None:
            print(speed)
            continue
        residuals = scale * np.einsum("ij...,jn...->in...", turn, models) + shift[:, None] - targets
        off = np.sqrt(np.mean(turn_of(mxm(transposed(turn), turns)) ** 2)) * 200_000.0 / np.pi
        accuracy = f"{np.sqrt(np.mean(residuals**2)):14.5f}{sigma * np.sqrt(11.0 / 18.0):8.5f}{off:26.3f}"
        print(f"{speed}{accuracy}{peers / took:16.1f}")
    ours = rows[0][1]
    times = peers / ours if pycolmap else None
    return [Figure("similarity, a model of many", 1e6 * ours, "us", "pycolmap", times, TARGETS["similarity"])]


def _similarity_by_pycolmap(pycolmap, models, targets):
    sources, sinks = (np.ascontiguousarray(np.moveaxis(each, -1, 0).swapaxes(1, 2)) for each in (models, targets))
    found = []

    def fit():
        found[:] = [pycolmap.estimate_sim3d(a, b) for a, b in zip(sources, sinks, strict=True)]

    took = best_time(fit, 3) / len(sources)
    turns = np.stack([each.rotation.matrix() for each in found], axis=-1)
    shifts = np.stack([each.translation for each in found], axis=-1)
    return took, np.array([each.scale for each in found]), turns, shifts


BENCHMARKS = {"relative": relative, "similarity": similarity}


def on_one_thread():
    """Start this program again with libraries on one thread, unless they already are."""
    if any(os.environ.get(name) != "1" for name in THREADS):  # libraries read it when they are loaded
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **dict.fromkeys(THREADS, "1")})


def main():
    return [figure for each in sys.argv[1:] or BENCHMARKS for figure in BENCHMARKS[each]()]


if __name__ == "__main__":
    on_one_thread()
    tell(main)
