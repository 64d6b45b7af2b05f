"""Variants of an asset's materials (KHR_materials_variants), as two files are compared by them."""

from __future__ import annotations

from collections.abc import Sequence

from meshcone.assets.content import Content, Mesh


def variant_names(content: Content) -> dict[str, str]:
    """Variants by what messages call them."""
    return {f"variant {name}": name for name in content.variants}


def variants_of(mesh: Mesh, called: Sequence[str], default: str) -> dict[str, str]:
    """What each variant draws a mesh with: the material it takes the place of, and its own.

    How a mesh is divided into primitives does not count, nor does a variant that changes nothing.

    Args:
        mesh: the mesh.
        called: what the materials are called.
        default: what a mesh without one has.
    """
    found: dict[str, set[str]] = {}
    for primitive in mesh.primitives:
        own = default if primitive.material is None else called[primitive.material]
        for name, number in primitive.variants:
            if number != primitive.material:
                found.setdefault(name, set()).add(f"{called[number]} for {own}")
    return {f"variant '{name}'": ", ".join(sorted(each)) for name, each in found.items()}
