"""Bring a noisy scan onto its reference, prove how close it is, and draw both."""

from __future__ import annotations

import numpy as np
import trimesh
from matplotlib.figure import Figure

import meshcone


def main() -> None:
    """Refine a noisy torus and write it with its report, its certificate and a picture."""
    reference = trimesh.creation.torus(1.0, 0.4, major_sections=64, minor_sections=32)
    noise = np.random.default_rng(0).normal(scale=0.02, size=reference.vertices.shape)
    scan = trimesh.Trimesh(reference.vertices + noise, reference.faces)

    refined = meshcone.refine(scan, reference)
    print(refined)
    print(refined.report.statement)
    refined.save("torus.obj", report="torus.json")  # torus.certificate.npz comes with it

    verification = meshcone.verify(refined)
    print("verified" if verification else "not verified")
    draw({"scan": scan, "refined": refined.mesh, "reference": reference}, "torus.png")


def draw(meshes: dict[str, trimesh.Trimesh], name: str) -> None:
    """Draw meshes side by side."""
    figure = Figure(figsize=(4 * len(meshes), 4))
    for place, (title, mesh) in enumerate(meshes.items(), start=1):
        axes = figure.add_subplot(1, len(meshes), place, projection="3d", title=title)
        axes.plot_trisurf(*mesh.vertices.T, triangles=mesh.faces, color="lightsteelblue")
        axes.set_box_aspect((1, 1, 0.4))
        axes.set_axis_off()
    figure.savefig(name, dpi=100, bbox_inches="tight")


if __name__ == "__main__":
    main()
