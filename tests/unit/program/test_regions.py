"""A mesh solved region by region: how it is divided, and what comes of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from meshcone.options import Options, SurfaceOptions, parse_options
from meshcone.program.answer import RefinedPositions
from meshcone.program.certificate import residuals
from meshcone.program.cones import (
    ConeFamily,
    DisplacementCaps,
    EdgeCaps,
    Orientation,
    Pins,
    ToleranceBand,
)
from meshcone.program.correspondence import round_objective
from meshcone.program.multipliers import Multipliers
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.region_solver import within_regions
from meshcone.program.regions import divide, region_count
from meshcone.program.restriction import RestrictedCones, restricted_objective
from meshcone.program.rounds import refine_surface
from meshcone.program.source_structure import SourceStructure
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from tests.meshes import cylinder, noisy, sphere, torus

PIPE = cylinder(24, 19, 0.5, 1.5)
SHORTER = Mesh(PIPE.vertices, PIPE.faces[PIPE.corners[:, :, 2].max(axis=1) < 0.3])
ROUGH = noisy(torus(), 0.01, seed=4)
RING = torus(96, 48)


def structure_of(source: Mesh, reference: Mesh) -> SourceStructure:
    prepared = PreparedReference.of(reference, len(source.vertices), seed=1)
    return SourceStructure.of(source, prepared, noise_scale=0.5)


def refined(regions: int, **options: Any) -> RefinedPositions:
    given = {"effort": "fast", "surface": {"regions": regions}, "solver": {"certify": False}}
    return refine_surface(ROUGH, RING, parse_options({**given, **options}))


def distance_both_ways(positions: np.ndarray) -> float:
    mesh = ROUGH.moved_to(positions)
    one, other = (sample_surface(surface, 8192, seed=91).points for surface in (mesh, RING))
    there = SurfaceTree(RING).closest(one).distances.mean()
    back = SurfaceTree(mesh).closest(other).distances.mean()
    return float(there + back) / 2


@pytest.mark.parametrize("count", [1, 2, 3, 7, 64])
def test_each_vertex_is_the_own_of_one_of_regions_of_equal_size(count: int) -> None:
    coupling = structure_of(ROUGH, RING).laplacian

    regions = divide(ROUGH.vertices, coupling, count)

    together = np.concatenate([region.own for region in regions])
    sizes = [len(region.own) for region in regions]
    assert len(regions) == count
    assert sorted(together) == list(range(len(ROUGH.vertices)))
    assert max(sizes) - min(sizes) <= 2


def test_a_region_solves_for_its_own_and_for_the_rings_around_them() -> None:
    coupling = structure_of(ROUGH, RING).laplacian

    (region, _) = divide(ROUGH.vertices, coupling, 2, rings=2)

    expected = set(region.own)
    for _ in range(2):
        expected |= {v for edge in ROUGH.edges if expected & set(edge) for v in edge}
    assert set(region.free) == expected


@pytest.mark.parametrize(("vertices", "count"), [(250_000, 1), (250_001, 2), (4_000_000, 16)])
def test_auto_divides_a_mesh_by_its_size(vertices: int, count: int) -> None:
    options = Options(surface=SurfaceOptions(regions="auto"))

    assert region_count(options, vertices) == count


def test_there_are_no_more_regions_than_vertices() -> None:
    assert region_count(parse_options({"surface": {"regions": 4096}}), 66) == 66


def test_scs_is_given_the_whole_program_where_it_solves() -> None:
    options = parse_options({"surface": {"regions": 3}, "solver": {"method": "full"}})

    assert region_count(options, 1000) == 1


@pytest.mark.parametrize(
    ("round_index", "source", "reference"),
    [(0, ROUGH, RING), (1, ROUGH, RING), (3, ROUGH, RING), (3, noisy(PIPE, 0.01), SHORTER)],
    ids=["first round", "with reverse pulls", "with face pulls", "open, beyond the reference"],
)
def test_a_restricted_objective_has_the_gradient_of_the_whole(
    round_index: int, source: Mesh, reference: Mesh
) -> None:
    prepared = PreparedReference.of(reference, len(source.vertices), seed=1)
    structure = SourceStructure.of(source, prepared, noise_scale=0.5)
    whole = round_objective(round_index, source, prepared, structure, SurfaceOptions())
    region = divide(source.vertices, structure.laplacian, 3, rings=2)[1]
    moved = noisy(source, 0.02, seed=9).vertices
    free = np.repeat(3 * region.free, 3) + np.tile(np.arange(3), len(region.free))

    restricted = restricted_objective(whole, region.free, moved)
    x = moved[region.free].ravel()

    expected = (whole.apply(moved.ravel()) + whole.linear)[free]
    assert np.allclose(restricted.apply(x) + restricted.linear, expected, atol=1e-12)
    assert np.allclose(restricted.matrix() @ x, restricted.apply(x), atol=1e-11)
    assert np.allclose(restricted.product()(x), restricted.apply(x), atol=1e-11)
    blocks = whole.diagonal_blocks().entries[region.free]
    assert np.allclose(restricted.diagonal_blocks().entries, blocks, atol=1e-12)


def test_a_restricted_objective_differs_from_the_whole_by_a_constant() -> None:
    prepared = PreparedReference.of(RING, len(ROUGH.vertices), seed=1)
    structure = SourceStructure.of(ROUGH, prepared, noise_scale=0.5)
    whole = round_objective(3, ROUGH, prepared, structure, SurfaceOptions())
    free = divide(ROUGH.vertices, structure.laplacian, 3)[1].free
    restricted = restricted_objective(whole, free, ROUGH.vertices)

    def difference(seed: int) -> float:
        positions = ROUGH.vertices.copy()
        positions[free] += np.random.default_rng(seed).normal(size=(len(free), 3))
        x, y = positions.ravel(), positions[free].ravel()
        of_whole = 0.5 * x @ whole.apply(x) + whole.linear @ x + whole.constant
        of_part = 0.5 * y @ restricted.apply(y) + restricted.linear @ y + restricted.constant
        return float(of_whole - of_part)

    assert difference(1) == pytest.approx(difference(2), rel=1e-9)


def families() -> list[ConeFamily]:
    vertices, count = ROUGH.vertices, len(ROUGH.vertices)
    normals = ROUGH.vertex_normals
    return [
        EdgeCaps.relative(ROUGH, 1.0),
        DisplacementCaps.uniform(vertices, 0.01),
        Pins.at(vertices, np.arange(0, count, 5)),
        ToleranceBand(np.arange(count)[:, None], vertices, normals, 0.01),
        Orientation.at(ROUGH, ROUGH.face_normals, np.ones(len(ROUGH.faces), dtype=bool)),
    ]


@pytest.mark.parametrize("family", families(), ids=lambda family: family.kind)
def test_a_restricted_cone_has_the_slack_it_has_in_the_whole(family: ConeFamily) -> None:
    free = divide(ROUGH.vertices, structure_of(ROUGH, RING).laplacian, 3, rings=2)[1].free
    moved = noisy(ROUGH, 0.02, seed=9).vertices

    cones = RestrictedCones.of(family, free, len(moved))

    inside = np.isin(family.vertices, free).all(axis=1)
    assert np.array_equal(cones.which, np.flatnonzero(inside))
    assert np.allclose(cones.family.slack(moved[free]), family.slack(moved)[inside], atol=1e-15)
    A, b = cones.family.rows(np.arange(len(cones.family)), len(free))
    written = (b - A @ moved[free].ravel()).reshape(-1, family.dimension)
    assert np.allclose(written, family.slack(moved)[inside], atol=1e-12)


def test_multipliers_of_all_regions_are_those_of_the_whole() -> None:
    family = EdgeCaps.relative(ROUGH, 1.0)
    which = np.arange(0, len(family), 3)
    values = np.random.default_rng(2).normal(size=(len(which), 4))
    found: dict[int, np.ndarray] = {}

    for region in divide(ROUGH.vertices, structure_of(ROUGH, RING).laplacian, 5, rings=1):
        own = np.isin(np.arange(len(ROUGH.vertices)), region.own)
        cones = RestrictedCones.of(family, region.free, len(ROUGH.vertices))
        inward = cones.inward([Multipliers(family, which, values)])
        places, mine = cones.outward(inward, own)
        assert not set(places.tolist()) & set(found)
        found |= dict(zip(places.tolist(), mine, strict=True))

    assert sorted(found) == which.tolist()
    assert np.array_equal([found[place] for place in which.tolist()], values)


CONES: dict[str, dict[str, Any]] = {
    "no cone": {},
    "edges, all of which must shrink": {"cones": {"edge_cap": {"times_local_median": 1.1}}},
    "displacement": {"cones": {"max_displacement": {"relative": 0.01}}},
    "pins": {"cones": {"pin": {"vertices": list(range(0, 1152, 50))}}},
    "best": {"effort": "best"},
}


@pytest.mark.parametrize("asked", CONES)
@pytest.mark.parametrize("count", [2, 3, 7])
def test_regions_come_as_close_as_the_whole_and_end_at_its_optimum(count: int, asked: str) -> None:
    whole, divided = refined(1, **CONES[asked]), refined(count, **CONES[asked])

    final = divided.final
    assert final is not None
    assert divided.regions is not None
    assert divided.regions.count == count
    found = residuals(final.objective, final.families, final.positions, final.multipliers)
    assert found.worst <= 1e-5
    near, best = distance_both_ways(divided.positions), distance_both_ways(whole.positions)
    assert near <= 1.02 * best


def test_where_regions_meet_there_is_no_seam() -> None:
    answer = refined(3)
    regions = divide(ROUGH.vertices, structure_of(ROUGH, RING).laplacian, 3)
    region = np.empty(len(ROUGH.vertices), dtype=np.int64)
    for number, part in enumerate(regions):
        region[part.own] = number
    mesh = ROUGH.moved_to(answer.positions)
    # How far neighbours differ in how far off the reference they end.
    off = SurfaceTree(RING).closest(mesh.vertices).distances
    steps = np.abs(off[mesh.edges[:, 0]] - off[mesh.edges[:, 1]])
    between = region[mesh.edges[:, 0]] != region[mesh.edges[:, 1]]

    assert between.any()
    assert steps[between].max() <= steps[~between].max()
    assert steps[between].mean() <= 1.1 * steps[~between].mean()


def test_the_answer_says_how_the_mesh_was_divided() -> None:
    record = refined(4).regions

    assert record is not None
    assert record.vertices == [288, 288, 288, 288]
    assert all(found > 288 for found in record.solved_for)
    assert record.rounds == 5
    assert record.rounds_together == 1
    assert record.products_together >= 1


def test_a_chain_of_tight_edges_is_within_regions_until_it_leads_out_of_one() -> None:
    edges, vertices = EdgeCaps.relative(ROUGH, 1.0), len(ROUGH.vertices)
    regions = divide(ROUGH.vertices, structure_of(ROUGH, RING).laplacian, 2, rings=2)
    inside = np.isin(edges.vertices, regions[0].free).all(axis=1)

    def tight(chosen: np.ndarray) -> list[Multipliers]:
        which = np.flatnonzero(chosen)
        return [Multipliers(edges, which, np.ones((len(which), 4)))]

    assert within_regions(regions, [], vertices)
    assert within_regions(regions[:1], tight(inside), vertices)
    assert not within_regions(regions[:1], tight(np.ones(len(edges), dtype=bool)), vertices)


def test_a_mesh_that_is_not_divided_says_nothing_of_regions() -> None:
    assert refined(1).regions is None


def test_regions_of_a_sphere_that_are_too_small_to_have_an_outside_give_the_whole() -> None:
    source, reference = noisy(sphere(1), 0.02), sphere(3)
    whole, divided = (
        refine_surface(
            source,
            reference,
            parse_options(
                {"effort": "fast", "surface": {"regions": count}, "solver": {"certify": False}}
            ),
        )
        for count in (1, 5)
    )

    assert np.allclose(divided.positions, whole.positions, atol=1e-9)
