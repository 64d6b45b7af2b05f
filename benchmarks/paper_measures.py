"""What the paper's tables measure, on one shape: records that go into a file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from paper_meshes import PaperMeshes, unavailable
from paper_program import Setting, in_unit_sphere, solve_as_written

from meshcone.quality.metrics import compare, earth_movers_distance
from meshcone.quality.sampled import SampledSurface, Sampling
from meshcone.quality.validity import inspect
from meshcone.surface import Mesh

Record = dict[str, float]

MEASURED = [
    "target",
    "sphere_same",
    "paper_same",
    "surface_same",
    "sphere_own",
    "paper_own",
    "surface_own",
    "laplacian_own",
    "projection_own",
    "marching_cubes",
    "surface_cubes",
    "poisson",
]
SCAN_MEASURED = [
    "target",
    "marching_cubes",
    "paper_cubes",
    "surface_cubes",
    "laplacian_cubes",
]
BEST_MEASURED = ["best_same", "best_own"]
# A copy of the target has the target's own.
EMD_MEASURED = ["target", "marching_cubes", "poisson"]

# Of the paper's tables: 5,000 samples, in the ablations 10,000; drawn independently. The
# curvature error is this project's, so is its number of samples.
_SAMPLES, _ABLATION_SAMPLES, _CURVATURE_SAMPLES = 5000, 10_000, 512
_UNUSED = 16  # samples of a metric that is not looked at
_SEED = 0


@dataclass(frozen=True)
class Counts:
    """Samples for the earth mover's distance: of every mesh, and of the few measured again."""

    emd: int = 1024
    more_emd: int = 5000


def measure_all(meshes: PaperMeshes, names: list[str], counts: Counts) -> dict[str, Record]:
    """Every metric of each mesh, the target's second set of samples for the floor included."""
    sampling = Sampling(_SAMPLES, counts.emd, _CURVATURE_SAMPLES, "random")
    reference = SampledSurface(meshes["target"].mesh, sampling, _SEED + 1)
    return {
        name: _measure(meshes[name].mesh, reference, sampling) | meshes[name].record
        for name in names
        if not unavailable(name)
    }


def measure_emd(meshes: PaperMeshes, counts: Counts) -> dict[str, Record]:
    """The earth mover's distance of a few meshes, from more samples."""
    sampling = Sampling(_UNUSED, counts.more_emd, _UNUSED, "random")
    reference = SampledSurface(meshes["target"].mesh, sampling, _SEED + 1).matching
    records = {}
    for name in EMD_MEASURED:
        if not unavailable(name):
            points = SampledSurface(meshes[name].mesh, sampling, _SEED).matching
            records[name] = {"emd": earth_movers_distance(points, reference)}
    return records


def measure_ablations(meshes: PaperMeshes, settings: Iterable[Setting]) -> dict[str, Record]:
    """The paper's program on the same-size sphere under some λ and δ, by ``Setting.key``.

    The answers are scaled into the unit sphere as the paper scales its own: where caps bind,
    no similarity undoes what the program did.
    """
    sampling = Sampling(_ABLATION_SAMPLES, _UNUSED, _UNUSED, "random")
    target, source = meshes["target"].mesh, meshes["sphere_same"].mesh
    reference = SampledSurface(target, sampling, _SEED + 1)
    records = {}
    for setting in settings:
        solve = solve_as_written(source, target, setting)
        measured = _measure(in_unit_sphere(solve.mesh), reference, sampling)
        chosen = {name: measured[name] for name in ("chamfer", "hausdorff", "normals")}
        records[setting.key] = chosen | solve.record
    floor = _measure(target, reference, sampling)
    records["floor"] = {name: floor[name] for name in ("chamfer", "hausdorff", "normals")}
    return records


def measure_solver(meshes: PaperMeshes) -> dict[str, Record]:
    """What the paper's program costs in the reduced form; as written it is among the meshes."""
    return {"reduced": meshes["reduced_same"].record}


def _measure(mesh: Mesh, reference: SampledSurface, sampling: Sampling) -> Record:
    found = compare(SampledSurface(mesh, sampling, _SEED), reference, inspect(mesh, 0))
    return {
        "chamfer": found.chamfer,
        "emd": found.emd,
        "hausdorff": found.hausdorff,
        "normals": found.normal_consistency,
        "curvature": found.curvature_error,
        "distance": found.point_to_surface.mean,
        "surface_normals": found.surface_normal_consistency,
        "aspect": found.aspect_ratio.mean,
        "aspect_median": found.aspect_ratio.median,
        "vertices": len(mesh.vertices),
    }
