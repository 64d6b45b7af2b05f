from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.demo.convergence import draw_convergence


def report(lengths: list[int], gap: float) -> dict[str, Any]:
    mean = {"point_to_surface": {"mean": 0.01}}
    return {
        "options": {"solver": {"tolerance": 1e-5}},
        "quality": {"input": mean, "refined": mean},
        "solver": {
            "rounds": [
                {
                    "round": number,
                    "movement": 0.0 if number > 1 else 0.1,
                    "info": {"iterations": length - 1},
                    "history": {
                        "iter": list(np.arange(length)),
                        "res_pri": [1e-15] * length,
                        "res_dual": [1e-6] * length,
                        "gap": [gap] * length,
                    },
                }
                for number, length in enumerate(lengths, start=1)
            ]
        },
    }


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("lengths", [[1], [1, 1, 1, 1, 1], [400, 1, 12]])
@pytest.mark.parametrize("gap", [1e-6, -1e-6, 0.0, 1e300])
def test_any_history_can_be_drawn(lengths: list[int], gap: float) -> None:
    assert draw_convergence(report(lengths, gap)).startswith(b"\x89PNG")
