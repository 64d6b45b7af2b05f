"""What is said of vertices that are nowhere: graphics hardware draws no triangle that uses one."""

from __future__ import annotations

from collections.abc import Iterator

from meshcone.notices import Code, Notice


def astray(vertices: int, faces: int, kind: str = "triangles") -> Iterator[Notice]:
    """A warning of vertices without finite coordinates, if there are any.

    Args:
        vertices: how many there are.
        faces: how many faces use one, and so are not read.
        kind: what these are called.
    """
    if vertices:
        words = f"vertices without finite coordinates: {vertices:,}; "
        words += f"{kind} that use them, and so are not drawn: {faces:,}"
        yield Notice(Code.VERTICES_ASTRAY, words)
