"""Constraints that contradict each other: found fast, and said in words."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.errors import InfeasibleError
from meshcone.files import MeshFile
from meshcone.options import SolverOptions, parse_options
from meshcone.program.cones import DisplacementCaps, EdgeCaps, Pins
from meshcone.program.feasibility import require_feasible
from meshcone.program.infeasibility import ContradictionError
from meshcone.verbs.refine import refine
from tests.meshes import sheet, sphere


def obj(mesh: object) -> bytes:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]  # type: ignore[attr-defined]
    lines += ["f {} {} {}".format(*(face + 1)) for face in mesh.faces]  # type: ignore[attr-defined]
    return ("\n".join(lines) + "\n").encode()


def test_pins_farther_apart_than_the_edges_between_them_allow():
    mesh = sheet(6, 2)
    families = [EdgeCaps.uniform(mesh, 0.9), Pins.at(mesh.vertices, np.array([0, 10]))]

    with pytest.raises(ContradictionError) as caught:
        require_feasible(families, mesh.vertices, SolverOptions())

    kinds = {conflict.kind for conflict in caught.value.conflicts}
    assert kinds == {"edge_cap", "pin"}
    named = {int(v) for c in caught.value.conflicts for v in c.vertices}
    assert {0, 10} <= named


def test_constraints_that_only_the_input_violates_are_no_contradiction():
    mesh = sheet(6, 2)
    families = [EdgeCaps.uniform(mesh, 0.9), DisplacementCaps.uniform(mesh.vertices, 2.0)]

    require_feasible(families, mesh.vertices, SolverOptions())


def test_the_message_names_the_kinds_the_vertices_of_the_file_and_what_to_relax():
    mesh = sheet(6, 3)
    raised = mesh.moved_to(mesh.vertices + np.array([0, 0, 0.25]))
    options = parse_options(
        {
            "effort": "fast",
            "cones": {"max_displacement": {"model": 0.1}, "tolerance_band": {"model": 0.1}},
        }
    )

    with pytest.raises(InfeasibleError) as caught:
        refine(MeshFile("a.obj", obj(raised)), MeshFile("b.obj", obj(mesh)), options)

    assert caught.value.kind == "infeasible"
    assert caught.value.file == "a.obj"
    for word in ("max_displacement", "tolerance_band", "vertex ", "To relax", "0.25)"):
        assert word in caught.value.message


def test_a_side_farther_away_than_a_vertex_may_move_is_a_contradiction_in_words():
    options = parse_options(
        {
            "effort": "fast",
            "cones": {
                "stay": "outside",
                "offset": {"model": 0.5},
                "max_displacement": {"model": 0.1},
            },
        }
    )
    ball = MeshFile("ball.obj", obj(sphere(2)))

    with pytest.raises(InfeasibleError) as caught:
        refine(ball, ball, options)

    for word in ("max_displacement", "stay", "cones.offset"):
        assert word in caught.value.message
    assert caught.value.message.count("cones.offset") == 1
