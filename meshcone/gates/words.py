"""What a check found, in words for whoever made the asset."""

from __future__ import annotations

from collections.abc import Iterable

from meshcone.gates.rules import Allowed

_NAMES = {
    "deviation.max": "proven deviation",
    "deviation.extra": "proven distance that the mesh goes beyond the reference",
    "deviation.missing": "proven distance that the reference is not covered",
    "deviation.outside": "distance that the mesh goes outside of the reference",
    "deviation.inside": "distance that the mesh goes inside of the reference",
    "deviation.area_beyond": "share of the area beyond the tolerance",
    "deviation.area_beyond.extra": "share of the mesh's area beyond the tolerance",
    "deviation.area_beyond.missing": "share of the reference's area beyond the tolerance",
    "point_to_surface.mean": "mean deviation",
    "point_to_surface.rms": "root mean square deviation",
    "point_to_surface.p95": "deviation of all but the worst 5 % of the surface",
    "point_to_surface.max": "worst deviation",
    "chamfer": "chamfer distance (squared)",
    "chamfer_l1": "chamfer distance",
    "hausdorff": "Hausdorff distance of the samples",
    "hausdorff95": "Hausdorff distance of all but the worst 5 % of the samples",
    "emd": "earth mover's distance",
    "normal_consistency": "agreement of normals with the nearest sample",
    "surface_normal_consistency": "agreement of normals with the closest face",
    "normal_deviation_deg": "mean deviation of normals, in degrees,",
    "curvature_error": "mean error of curvature",
    "fscore": "F-score",
    "aspect_ratio.mean": "mean aspect ratio of the faces",
    "aspect_ratio.median": "median aspect ratio of the faces",
    "aspect_ratio.share_over_4": "share of slivers among the faces",
    "validity.watertight": "watertight",
    "validity.boundary_edges": "number of edges on open borders",
    "validity.non_manifold_edges": "number of edges where more than two faces meet",
    "validity.cracks": "number of border edges along another border",
    "validity.opposed_edges": "number of edges between faces turned in opposite directions",
    "validity.degenerate_faces": "number of faces without area",
    "validity.duplicate_faces": "number of faces that are there twice",
    "validity.flipped_faces": "number of faces turned over by the refinement",
    "validity.self_intersections": "number of pairs of faces that pass through each other",
    "validity.components": "number of separate pieces",
    "appearance.color_difference.mean": "mean colour difference (CIEDE2000)",
    "appearance.color_difference.p95": "colour difference (CIEDE2000) of all but the worst 5 % of "
    "the surface",
    "appearance.color_difference.max": "worst colour difference (CIEDE2000)",
    "appearance.color_difference.psnr": "peak signal-to-noise ratio of the colours",
    "displacement.mean": "mean movement of the vertices",
    "displacement.max": "largest movement of a vertex",
    "certificate.holds": "certificate of the solution",
    "warnings": "number of warnings",
}
_NOTHING = 1e-12  # of the largest coordinate: what rounding leaves
_LEAST_DIGITS, _MOST_DIGITS = 3, 17  # 17 decimal digits tell any two doubles apart


def name_of(key: str) -> str:
    """Name a value of the report in words; by its key where there are none."""
    section, _, code = key.partition(".")
    if section == "warnings" and code:
        return f"number of warnings '{code}'"
    return _NAMES.get(key, key)


def names_in_words() -> dict[str, str]:
    """The values of a report that have a name in words, with that name."""
    return {key: name.removesuffix(",") for key, name in _NAMES.items()}


def label(status: str, severity: str) -> str:
    """Name the status of a check; what only warns is written small."""
    if status == "pass":
        return "ok"
    if status == "not_tested":
        return "NOT TESTED" if severity == "error" else "not tested"
    return "FAILED" if severity == "error" else "warning"


def number(value: float, beside: float | None = None) -> str:
    """Write a number with as few digits as leave it different from the one it stands beside."""
    for digits in range(_LEAST_DIGITS, _MOST_DIGITS + 1):
        written = f"{value:.{digits}g}"
        if beside is None or value == beside or written != f"{beside:.{digits}g}":
            break
    # Counts are written in full, whatever their number of digits.
    return f"{value:.0f}" if float(value).is_integer() and abs(value) < 1e9 else written


def point(position: Iterable[float]) -> str:
    """Write a position; a coordinate that is nothing beside the others is 0."""
    values = list(position)
    least = _NOTHING * max(map(abs, values), default=0.0)
    return f"({', '.join(f'{value if abs(value) > least else 0:.4g}' for value in values)})"


def stated(value: Allowed) -> str:
    """Write a truth value, a word or the words allowed."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return " or ".join(f"'{word}'" for word in value)
    return number(value) if isinstance(value, float) else f"'{value}'"
