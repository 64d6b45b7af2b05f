"""The materials of an asset."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from meshcone.assets.content import Material
from meshcone.auditing.records.materials import MaterialRecord, Materials
from meshcone.auditing.subject import Subject


def materials_of(subject: Subject) -> Materials:
    """Describe every material and count what is wrong with them."""
    content = subject.content
    materials = content.materials
    drawn: Counter[int | None] = Counter()
    for draw in content.draws:
        drawn[draw.material] += len(draw.rows)
    named = [material.name for material in materials if material.name]
    alike = Counter(replace(material, name="") for material in materials if material.defined)
    modes = Counter(material.alpha_mode for material in materials)
    return Materials(
        count=len(materials),
        names=tuple(material.name for material in materials),
        unnamed=len(materials) - len(named),
        unused=sum(not drawn[number] for number in range(len(materials))),
        undefined=sum(not material.defined for material in materials)
        + sum(primitive.undefined for mesh in content.meshes for primitive in mesh.primitives),
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
