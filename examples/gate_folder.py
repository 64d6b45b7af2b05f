"""Take thresholds from accepted exports, and hold new exports against them."""

from __future__ import annotations

import numpy as np
import trimesh

import meshcone


def main() -> None:
    """Accept three exports of a master, then judge a good and a bad one."""
    master = trimesh.creation.icosphere(subdivisions=3)
    accepted = {
        f"export {seed}": meshcone.measure(exported(master, seed), master) for seed in range(3)
    }
    gates = meshcone.thresholds(accepted)
    print("proposed: deviation.max at most", gates["deviation.max"]["max"], "of the radius")

    chosen = {key: gates[key] for key in ("deviation.max", "asset.geometry.watertight")}
    chosen["deviation.max"] = {"max": round(1.5 * gates["deviation.max"]["max"], 4)}
    for name, mesh in {"good": exported(master, 7), "torn": torn(master)}.items():
        verdict = meshcone.gate(mesh, master, gates=chosen)
        print(name, "passes" if verdict else "fails")


def exported(mesh: trimesh.Trimesh, seed: int) -> trimesh.Trimesh:
    """A copy as an exporter writes it that rounds coordinates."""
    shift = np.random.default_rng(seed).uniform(-5e-4, 5e-4, mesh.vertices.shape)
    return trimesh.Trimesh(mesh.vertices + shift, mesh.faces)


def torn(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """A copy that lost faces on its way."""
    return trimesh.Trimesh(mesh.vertices, mesh.faces[20:])


if __name__ == "__main__":
    main()
