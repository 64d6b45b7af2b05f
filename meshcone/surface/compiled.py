"""Functions over arrays that numba compiles to machine code."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compiled(signature: str | None = None) -> Callable[[Kernel], Kernel]:
    """Have a function compiled.

    The machine code is kept beside the source, or in the user's cache directory where that
    cannot be written, or in ``NUMBA_CACHE_DIR`` if that is set. Where none of these can be
    written, every process compiles for itself, which takes seconds and changes no result.

    Sums keep the order in which they are written, so the same input gives the same bits on all
    processors of one kind.

    Args:
        signature: the types, as numba writes them: the function is compiled when its module is
            imported, so that processes forked later have it. Without it, the function is
            compiled with the first one that calls it.
    """
    types = () if signature is None else (signature,)
    options: dict[str, Any] = {"error_model": "numpy", "nogil": True}

    def compile_(kernel: Kernel) -> Kernel:
        try:
            found: Kernel = numba.njit(*types, cache=True, **options)(kernel)
        except RuntimeError:  # there is no place to keep it
            found = numba.njit(*types, **options)(kernel)
        return found

    return compile_
