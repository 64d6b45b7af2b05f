"""The materials of an asset."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Self

from pydantic import Field

from meshcone.assets.content import Material
from meshcone.audit.records import Section
from meshcone.audit.subject import Subject


class MaterialRecord(Section):
    """One material."""

    name: str
    base_color: tuple[float, float, float, float] = Field(description="linear RGBA")
    metallic: float
    roughness: float
    emissive: tuple[float, float, float] = Field(description="linear RGB")
    alpha_mode: str
    double_sided: bool
    textures: tuple[str, ...] = Field(description="slots that have a texture")
    extensions: tuple[str, ...]
    triangles: int = Field(description="drawn with it")
    defined: bool = Field(description="whether the file, or a library that was sent, defines it")


class Materials(Section):
    """All materials together, and each of them."""

    count: int
    names: tuple[str, ...]
    unnamed: int
    unused: int = Field(description="materials that nothing is drawn with")
    undefined: int = Field(description="materials that are named and nowhere defined")
    missing_libraries: int = Field(description="material libraries that were not sent")
    duplicates: int = Field(description="materials that differ from an earlier one in name alone")
    same_names: int = Field(description="materials with the name of an earlier one")
    blended: int
    masked: int
    double_sided: int
    without_material: int = Field(description="triangles drawn with the default material")
    items: tuple[MaterialRecord, ...]

    @classmethod
    def of(cls, subject: Subject) -> Self:
        """Describe every material and count what is wrong with them."""
        content = subject.content
        materials = content.materials
        drawn: Counter[int | None] = Counter()
        for draw in content.draws:
            drawn[draw.material] += len(draw.rows)
        named = [material.name for material in materials if material.name]
        alike = Counter(replace(material, name="") for material in materials if material.defined)
        modes = Counter(material.alpha_mode for material in materials)
        return cls(
            count=len(materials),
            names=tuple(material.name for material in materials),
            unnamed=len(materials) - len(named),
            unused=sum(not drawn[number] for number in range(len(materials))),
            undefined=sum(not material.defined for material in materials),
            missing_libraries=sum(not sent for sent in content.libraries.values()),
            duplicates=sum(count - 1 for count in alike.values()),
            same_names=sum(count - 1 for count in Counter(named).values()),
            blended=modes["BLEND"],
            masked=modes["MASK"],
            double_sided=sum(material.double_sided for material in materials),
            without_material=drawn[None],
            items=tuple(_record(each, drawn[number]) for number, each in enumerate(materials)),
        )


def _record(material: Material, triangles: int) -> MaterialRecord:
    return MaterialRecord(
        name=material.name,
        base_color=material.base_color,
        metallic=material.metallic,
        roughness=material.roughness,
        emissive=material.emissive,
        alpha_mode=material.alpha_mode,
        double_sided=material.double_sided,
        textures=tuple(use.slot for use in material.textures),
        extensions=material.extensions,
        triangles=triangles,
        defined=material.defined,
    )
