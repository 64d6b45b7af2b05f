"""Ways to damage the surface of an asset, its normals and its texture coordinates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from damage_model import Model, Part
from damage_register import GLTF, Damage, damage

SEED = 7


def _each_point(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    def function(model: Model) -> None:
        for part in model.parts:
            part.positions = change(part.positions + part.place) - part.place

    return function


def _turn(points: np.ndarray) -> np.ndarray:
    return points[:, [0, 2, 1]] * (1, -1, 1)


damage("100 times the size")(_each_point(lambda points: 100 * points))
damage("inches for millimetres")(_each_point(lambda points: 25.4 * points))
damage("moved pivot")(_each_point(lambda points: points + np.array([0.3, 0, 0])))
damage("Z up")(_each_point(_turn))
damage("2 % flatter")(_each_point(lambda points: points * (1, 0.98, 1)))


@damage("noise of 1 %")
def _noise(model: Model) -> None:
    random = np.random.default_rng(SEED)
    for part in model.parts:
        values, same = np.unique(part.positions, axis=0, return_inverse=True)
        part.positions = part.positions + random.normal(0, 0.01, values.shape)[same.ravel()]


@damage("one vertex pulled out")
def _spike(model: Model) -> None:
    pot = model.parts[0]
    pot.positions = pot.positions.copy()
    pot.positions[200] *= (1.3, 1, 1.3)


@damage("mirrored")
def _mirror(model: Model) -> None:
    for part in model.parts:
        part.positions = part.positions * (-1, 1, 1)
        part.faces = part.faces[:, ::-1]
        if part.normals is not None:
            part.normals = part.normals * (-1, 1, 1)


@damage("a hole")
def _hole(model: Model) -> None:
    model.parts[0].faces = model.parts[0].faces[40:]


@damage("one face missing")
def _one_face(model: Model) -> None:
    model.parts[0].faces = np.delete(model.parts[0].faces, 300, axis=0)


@damage("lid missing")
def _no_lid(model: Model) -> None:
    del model.parts[1]


@damage("lid moved")
def _moved_lid(model: Model) -> None:
    model.parts[1].place = [0.0, 1.9, 0.0]


@damage("debris far away")
def _debris(model: Model) -> None:
    pot = model.parts[0]
    append(pot, np.array([[3, 0, 0], [3.02, 0, 0], [3, 0.02, 0]]), [[0, 1, 2]])


def append(part: Part, points: np.ndarray, faces: object) -> None:
    """Add triangles that look like the first vertex."""
    start = len(part.positions)
    part.positions = np.vstack([part.positions, points])
    for name in ("normals", "uvs", "colors", "joints", "weights", "target"):
        rows = getattr(part, name)
        if rows is not None:
            setattr(part, name, np.vstack([rows, np.repeat(rows[:1], len(points), axis=0)]))
    part.faces = np.vstack([part.faces, np.asarray(faces) + start])


@damage("winding flipped")
def _flip(model: Model) -> None:
    for part in model.parts:
        part.faces = part.faces[:, ::-1]


@damage("winding of one part flipped")
def _flip_one(model: Model) -> None:
    model.parts[1].faces = model.parts[1].faces[:, ::-1]


@damage("ten faces flipped")
def _flip_some(model: Model) -> None:
    faces = model.parts[0].faces.copy()
    faces[100:110] = faces[100:110, ::-1]
    model.parts[0].faces = faces


@damage("faces doubled")
def _double(model: Model) -> None:
    lid = model.parts[1]
    lid.faces = np.vstack([lid.faces, lid.faces])


@damage("faces without area")
def _flat(model: Model) -> None:
    lid = model.parts[1]
    lid.faces = np.vstack([lid.faces, lid.faces[:5, [0, 0, 1]]])


@damage("a fin on an edge")
def _fin(model: Model) -> None:
    pot = model.parts[0]
    edge = pot.positions[pot.faces[250, :2]]
    tip = edge.mean(axis=0) * (1.02, 1, 1.02)
    append(pot, np.vstack([edge, tip]), [[0, 1, 2]])


@damage("a seam torn open")
def _crack(model: Model) -> None:
    pot = model.parts[0]
    pot.positions = pot.positions.copy()
    pot.positions[::33] += (0.004, 0, 0.004)


@damage("four times the triangles")
def _subdivide(model: Model) -> None:
    for part in model.parts:
        _split(part)


def _split(part: Part) -> None:
    sides = np.sort(part.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    edges, number = np.unique(sides, axis=0, return_inverse=True)
    middles = number.reshape(-1, 3) + len(part.positions)
    for name in ("positions", "normals", "uvs", "colors", "weights", "target"):
        rows = getattr(part, name)
        if rows is not None:
            setattr(part, name, np.vstack([rows, rows[edges].mean(axis=1)]))
    if part.joints is not None:
        part.joints = np.vstack([part.joints, part.joints[edges[:, 0]]])
    if part.normals is not None:
        part.normals /= np.linalg.norm(part.normals, axis=1, keepdims=True)
    a, b, c = part.faces.T
    ab, bc, ca = middles.T
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    part.faces = np.vstack([np.column_stack(each) for each in corners])


@damage("smoothed away")
def _smooth(model: Model) -> None:
    for part in model.parts:
        _, same = np.unique(part.positions, axis=0, return_inverse=True)
        same = same.ravel()
        edges = np.vstack([same[part.faces[:, pair]] for pair in ([0, 1], [1, 2], [2, 0])])
        for _ in range(8):
            total = np.zeros((same.max() + 1, 3))
            count = np.zeros(same.max() + 1)
            where = np.zeros((same.max() + 1, 3))
            where[same] = part.positions
            for start, end in (edges.T, edges.T[::-1]):
                np.add.at(total, start, where[end])
                np.add.at(count, start, 1)
            part.positions = (total / count[:, None])[same]


@damage("UVs lost")
def _no_uvs(model: Model) -> None:
    for part in model.parts:
        part.uvs = None


@damage("UVs of one part lost")
def _no_uvs_of_one(model: Model) -> None:
    model.parts[2].uvs = None


def _uvs(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    def function(model: Model) -> None:
        for part in model.parts:
            if part.uvs is not None:
                part.uvs = change(part.uvs)

    return function


damage("UVs scrambled")(_uvs(lambda uvs: np.random.default_rng(SEED).permutation(uvs)))
damage("V flipped")(_uvs(lambda uvs: uvs * (1, -1) + (0, 1)))
damage("UVs all at one place")(_uvs(lambda uvs: np.full_like(uvs, 0.25)))
damage("UVs three times as large")(_uvs(lambda uvs: 3 * uvs))
damage("UVs mirrored")(_uvs(lambda uvs: uvs * (-1, 1) + (1, 0)))


@damage("UVs not finite", GLTF)
def _nan_uvs(model: Model) -> None:
    pot = model.parts[0]
    assert pot.uvs is not None
    pot.uvs = pot.uvs.copy()
    pot.uvs[10:20] = np.nan


@damage("normals lost")
def _no_normals(model: Model) -> None:
    for part in model.parts:
        part.normals = None


def _normals(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    def function(model: Model) -> None:
        for part in model.parts:
            if part.normals is not None:
                part.normals = change(part.normals)

    return function


damage("normals inverted")(_normals(lambda normals: -normals))
damage("normals zero")(_normals(np.zeros_like))
damage("normals all upwards")(_normals(lambda normals: np.tile([0.0, 1.0, 0.0], (len(normals), 1))))
