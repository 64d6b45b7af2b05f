"""What a worker does once, before it forks, so that none of its horses has to."""

from __future__ import annotations

import gc
from contextlib import suppress

from meshcone.errors import LimitError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.audit import examination
from meshcone.verbs.measure import measurement
from meshcone.verbs.refine import refine
from worker.run.artifacts import of_audit, of_measurement, of_refinement

_OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 %g\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
_OPTIONS = {
    "effort": "fast",
    "quality": {"samples": 100, "emd_samples": 16, "curvature_samples": 16},
}


def warm_up() -> None:
    """Have everything imported, compiled and read that the engine needs for any pair of meshes.

    Much of it comes with its first use, and a horse that is the first pays for it in every job:
    libraries, machine code that numba has stored or, where it can store none, has to make anew.
    """
    source, reference = (MeshFile("a.obj", _OBJ % height) for height in (1.1, 1.0))
    options = parse_options(_OPTIONS)
    with suppress(LimitError):  # an installation that takes no mesh at all
        of_refinement("a.obj", refine(source, reference, options))
        of_measurement("a.obj", measurement(source, reference, options))
        of_audit("a.obj", examination(source, reference, options))
    # Counting references to what is there already would copy its pages into every horse.
    gc.collect()
    gc.freeze()
