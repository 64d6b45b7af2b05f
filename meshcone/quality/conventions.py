"""What each metric means, in which unit, and from how many samples of which seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from meshcone.quality.curvature import BALL_RADIUS
from meshcone.quality.records import Convention, Conventions, Unit
from meshcone.quality.sampled import Sampling

_Drawn = Literal["samples", "emd_samples", "curvature_samples"]


@dataclass(frozen=True)
class _Definition:
    words: str
    unit: Unit
    drawn: _Drawn | None = "samples"


_DEFINITIONS = {
    "deviation": _Definition(
        "proven interval for the largest distance of any point of any triangle: extra of the "
        "mesh from the reference, missing of the reference from the mesh, max of both",
        "radius",
        None,
    ),
    "point_to_surface": _Definition(
        "exact distance of samples of either surface to the other's triangles; max: of samples "
        "and vertices, so a lower bound of the largest distance there is; see deviation.max",
        "radius",
    ),
    "chamfer": _Definition("mean d² A→B + mean d² B→A between samples (PyTorch3D)", "radius²"),
    "chamfer_l1": _Definition("mean d A→B + mean d B→A between samples", "radius"),
    "hausdorff": _Definition(
        "max of both directed maxima between samples; point_to_surface.max is to the surface "
        "itself",
        "radius",
    ),
    "hausdorff95": _Definition("max of both directed 95th percentiles between samples", "radius"),
    "normal_consistency": _Definition("½ (mean |n·n'| A→B + B→A), n' of the nearest sample", "1"),
    "surface_normal_consistency": _Definition(
        "½ (mean |n·n'| A→B + B→A), n' of the closest triangle", "1"
    ),
    "normal_deviation_deg": _Definition(
        "½ (mean arccos |n·n'| A→B + B→A), n' of the closest triangle", "degrees"
    ),
    "curvature_error": _Definition(
        "½ (mean |H - H'| A→B + B→A) at closest points, times the radius; H = ½ Σ β(e) "
        f"length(e ∩ ball) / (π r²), r = {BALL_RADIUS} (Cohen-Steiner & Morvan 2003)",
        "1",
        "curvature_samples",
    ),
    "fscore": _Definition(
        "harmonic mean of the shares of A and B with a sample of the other within τ = 0.01", "1"
    ),
    "emd": _Definition(
        "exact minimum over bijections of the mean distance (linear assignment)",
        "radius",
        "emd_samples",
    ),
    "color_difference": _Definition(
        "CIEDE2000 (Sharma, Wu & Dalal 2005) of base colours at samples of either surface and the "
        "closest point of the other that faces the same way",
        "ΔE00",
    ),
    "aspect_ratio": _Definition("L_max · perimeter / (4√3 · area) of the faces (VTK)", "1", None),
    "validity": _Definition("counts on welded vertices; null: not tested", "count", None),
}

_METHODS = {
    "sobol": "scrambled Sobol sequence on the area distribution",
    "random": "independent draws from the area distribution",
}


def conventions(sampling: Sampling, seed: int, reference_seed: int) -> Conventions:
    """Describe every metric under one sampling."""
    return Conventions(
        sampling=_METHODS[sampling.method],
        radius="largest distance of the reference's vertices from the centre of its bounding "
        "box; frame.radius gives it in model units",
        floor="the reference, drawn with the mesh's seed, against itself, drawn with its own",
        metrics={
            key: Convention(
                definition=found.words,
                unit=found.unit,
                samples=None if found.drawn is None else getattr(sampling, found.drawn),
                seed=None if found.drawn is None else seed,
                reference_seed=None if found.drawn is None else reference_seed,
            )
            for key, found in _DEFINITIONS.items()
        },
    )
