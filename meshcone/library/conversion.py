"""Arrays and trimesh's objects as the files that the engine reads and writes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from meshcone.errors import ArgumentError, InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from meshcone.surface.arrays import Floats, Ints

# GLB keeps single precision. Positions that it would move farther than this share of the
# mesh's size are too far from the origin for it.
_COARSEST = 1e-5

_NUMBERS = "biufO"  # kinds of arrays; those of objects may hold numbers

# Name and data of a file, its resources, its path, and the Trimesh it stands for.
_Parts = tuple[str, bytes, dict[str, bytes], None, Any]


def from_arrays(vertices: ArrayLike, faces: ArrayLike, name: str) -> _Parts:
    """Write arrays as an OBJ file, with every digit.

    Raises:
        InputError: they do not make a mesh; the message says which entry is wrong.
    """
    import trimesh

    points, corners = _checked(vertices, faces, name)
    mesh = trimesh.Trimesh(points, _triangles(points, corners), process=False, validate=False)
    return f"{name}.obj", _obj(points, corners), {}, None, mesh


def from_trimesh(mesh: Any, name: str) -> _Parts:
    """Write a ``Trimesh`` without materials as OBJ, anything else that is a mesh as GLB.

    Raises:
        ArgumentError: it is neither a ``Trimesh`` nor a ``Scene``.
        InputError: it is empty, or its positions do not fit the format.
    """
    import trimesh

    if isinstance(mesh, trimesh.primitives.Primitive):  # whose vertices cannot be moved
        mesh = mesh.to_mesh(visual=mesh.visual.copy())
    if isinstance(mesh, trimesh.Trimesh):
        points, corners = _checked(mesh.vertices, mesh.faces, name)
        if not mesh.visual.defined:
            return f"{name}.obj", _obj(points, corners), {}, None, mesh.copy()
        _require_precision(mesh, name)
        _require_colors_of_vertices(mesh, name)
        return f"{name}.glb", mesh.export(file_type="glb"), {}, None, mesh.copy()
    if isinstance(mesh, trimesh.Scene):
        meshes = [each for each in mesh.geometry.values() if isinstance(each, trimesh.Trimesh)]
        if not meshes:
            raise InputError("the scene has no meshes", file=name)
        for each in meshes:
            _checked(each.vertices, each.faces, name)
            _require_precision(each, name)
            _require_colors_of_vertices(each, name)
        return f"{name}.glb", mesh.export(file_type="glb"), {}, None, None
    raise ArgumentError(
        f"expected a trimesh.Trimesh or trimesh.Scene, found a trimesh {type(mesh).__name__}",
        file=name,
    )


def _checked(vertices: ArrayLike, faces: ArrayLike, name: str) -> tuple[Floats, Ints]:
    points, corners = _vertices(vertices, name), _faces(faces, name)
    _require_corners(corners, len(points), name)
    return points, corners


def _vertices(given: ArrayLike, name: str) -> Floats:
    _require_unmasked(given, "vertices", name)
    try:
        found = np.asarray(given)
        if found.dtype.kind not in _NUMBERS:
            raise TypeError(found.dtype)  # which would lose an imaginary part, or be a date
        vertices = np.array(found, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError("the vertices are not an (n, 3) array of numbers", file=name) from None
    except OverflowError:
        raise InputError(
            "the vertices are not all numbers that double precision can hold", file=name
        ) from None
    if vertices.size == 0:
        raise InputError("the mesh has no vertices", file=name)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(
            f"the vertices must have the shape (n, 3), found {vertices.shape}", file=name
        )
    wrong = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(wrong):
        place = f"vertex {wrong[0]}"
        raise InputError(
            f"{_coordinates(vertices[wrong[0]])} is not finite", file=name, place=place
        )
    return vertices


def _require_unmasked(given: ArrayLike, what: str, name: str) -> None:
    if np.ma.is_masked(given):
        raise InputError(
            f"some of the {what} are masked, and a mesh has no place for what is missing: leave "
            "them out",
            file=name,
        )


def _coordinates(vertex: Floats) -> str:
    return f"({', '.join(f'{value:g}' for value in vertex)})"


def _faces(given: ArrayLike, name: str) -> Ints:
    _require_unmasked(given, "faces", name)
    try:
        faces = np.asarray(given)
    except ValueError:
        raise InputError(
            "the faces are not an array: all must have the same number of corners",
            file=name,
        ) from None
    if faces.size == 0:
        raise InputError("the mesh has no faces", file=name)
    if faces.ndim != 2 or faces.shape[1] not in (3, 4):
        raise InputError(
            f"the faces must have the shape (m, 3) or (m, 4), found {faces.shape}", file=name
        )
    if faces.dtype.kind not in "iu":
        raise InputError(f"the faces must be integers, found {faces.dtype}", file=name)
    return faces.astype(np.int64)


def _triangles(points: Floats, faces: Ints) -> Ints:
    """The faces as triangles, split as the engine splits them."""
    from meshcone.assets.polygons import triangulate

    sizes = np.full(len(faces), faces.shape[1], dtype=np.int64)
    rows, _ = triangulate(points[faces].reshape(-1, 3), sizes)
    return np.asarray(faces.reshape(-1)[rows])


def _require_corners(faces: Ints, vertices: int, name: str) -> None:
    wrong = np.flatnonzero(((faces < 0) | (faces >= vertices)).any(axis=1))
    if len(wrong):
        corners = ", ".join(map(str, faces[wrong[0]]))
        raise InputError(
            f"the corners ({corners}) are not all among the {vertices:,} vertices, "
            "which are counted from 0",
            file=name,
            place=f"face {wrong[0]}",
        )


def _require_precision(mesh: Any, name: str) -> None:
    stored = mesh.vertices.astype(np.float32).astype(np.float64)
    size = float(np.ptp(mesh.vertices, axis=0).max())
    moved = float(np.abs(stored - mesh.vertices).max())
    if not moved <= _COARSEST * size:  # also where single precision ends in infinity
        raise InputError(
            f"single precision, which GLB stores, would move vertices by {moved:.2g} of a mesh "
            f"of size {size:.2g}: move the mesh to the origin, or leave out its materials",
            file=name,
        )


def _require_colors_of_vertices(mesh: Any, name: str) -> None:
    """Refuse colours of faces that a file with colours of vertices would blend at their corners."""
    if mesh.visual.kind != "face":
        return
    colors = np.asarray(mesh.visual.face_colors)
    corners = mesh.faces.reshape(-1)
    of_corners = np.repeat(colors, mesh.faces.shape[1], axis=0)
    least = np.full((len(mesh.vertices), colors.shape[1]), 255, dtype=colors.dtype)
    most = np.zeros_like(least)
    np.minimum.at(least, corners, of_corners)
    np.maximum.at(most, corners, of_corners)
    if (least < most).any():
        raise InputError(
            "its faces have colours, and a file has those of vertices, in which they would blend: "
            "call .unmerge_vertices() on a copy first, which gives each face vertices of its own, "
            "or give it without colours",
            file=name,
        )


def _obj(vertices: Floats, faces: Ints) -> bytes:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {' '.join(map(str, face))}" for face in (faces + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()
