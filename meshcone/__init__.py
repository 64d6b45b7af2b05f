"""Guided mesh refinement by second-order cone programming, with a certificate.

    import meshcone

    refined = meshcone.refine("source.glb", "reference.glb")
    refined.save("refined.glb")

``refine`` moves the vertices of a mesh, ``measure`` compares and moves nothing, ``audit`` says what
a whole asset is, ``gate`` gives a verdict, ``thresholds`` proposes gates, ``verify`` checks a
refinement without a solver, and ``load`` reads a mesh once for several of them. ``Client`` talks
to a service. Errors are in ``meshcone.errors``. The manual is ``docs/python.md``.

Importing this package is cheap: each name is loaded when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from meshcone import errors as errors
    from meshcone.certificate.checks import Verification
    from meshcone.library.functions import audit, gate, measure, refine, thresholds, verify
    from meshcone.library.inputs import LoadedMesh, load
    from meshcone.library.results import Audited, Measured, Refined, Verdict
    from service.client import Client, ServiceError

    __version__: str

# Public names and the modules they are loaded from.
_HOMES = {
    "Audited": "meshcone.library.results",
    "Client": "service.client",
    "LoadedMesh": "meshcone.library.inputs",
    "Measured": "meshcone.library.results",
    "Refined": "meshcone.library.results",
    "ServiceError": "service.client",
    "Verdict": "meshcone.library.results",
    "Verification": "meshcone.certificate.checks",
    "audit": "meshcone.library.functions",
    "gate": "meshcone.library.functions",
    "load": "meshcone.library.inputs",
    "measure": "meshcone.library.functions",
    "refine": "meshcone.library.functions",
    "thresholds": "meshcone.library.functions",
    "verify": "meshcone.library.functions",
}

__all__ = [
    "Audited",
    "Client",
    "LoadedMesh",
    "Measured",
    "Refined",
    "ServiceError",
    "Verdict",
    "Verification",
    "__version__",
    "audit",
    "errors",
    "gate",
    "load",
    "measure",
    "refine",
    "thresholds",
    "verify",
]


def __getattr__(name: str) -> Any:
    value: Any
    if name == "__version__":
        value = import_module("importlib.metadata").version("meshcone")
    elif name == "errors":
        return import_module("meshcone.errors")  # the import itself keeps it here
    elif name in _HOMES:
        value = getattr(import_module(_HOMES[name]), name)
    else:
        raise AttributeError(f"module 'meshcone' has no attribute '{name}'")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
