"""Make the files that the how-tos in docs/ work on."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual.material import PBRMaterial

VASE = ((0.0, 0.0), (0.5, 0.0), (0.62, 0.25), (0.7, 0.7), (0.55, 1.2), (0.35, 1.5), (0.45, 1.75))
LAMP = ((0.0, 0.0), (0.5, 0.0), (0.5, 0.08), (0.08, 0.12), (0.08, 1.0), (0.6, 1.05), (0.4, 1.6))
MUG = ((0.0, 0.0), (0.4, 0.0), (0.42, 0.9), (0.36, 0.9), (0.34, 0.08), (0.0, 0.08))
HEAD = ((0.0, -1.0), (0.55, -0.8), (0.85, -0.3), (0.95, 0.2), (0.75, 0.7), (0.4, 0.93), (0.0, 1.0))

# A solid of one face: a sphere of radius 20 mm around the origin (ISO 10303-214).
BALL_STEP = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('ball.step','2026-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
#1=APPLICATION_CONTEXT('core data for automotive mechanical design processes');
#2=APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#1);
#3=PRODUCT_CONTEXT('',#1,'mechanical');
#4=PRODUCT('ball','ball','',(#3));
#5=PRODUCT_DEFINITION_FORMATION('','',#4);
#6=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#7=PRODUCT_DEFINITION('design','',#5,#6);
#8=PRODUCT_DEFINITION_SHAPE('','',#7);
#9=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#10=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#11=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#12=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#9,'distance_accuracy_value','');
#13=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#12))
GLOBAL_UNIT_ASSIGNED_CONTEXT((#9,#10,#11))REPRESENTATION_CONTEXT('',''));
#14=SHAPE_DEFINITION_REPRESENTATION(#8,#15);
#15=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#16,#17),#13);
#16=AXIS2_PLACEMENT_3D('',#20,#21,#22);
#17=MANIFOLD_SOLID_BREP('ball',#23);
#20=CARTESIAN_POINT('',(0.,0.,0.));
#21=DIRECTION('',(0.,0.,1.));
#22=DIRECTION('',(1.,0.,0.));
#23=CLOSED_SHELL('',(#24));
#24=ADVANCED_FACE('',(#25),#26,.T.);
#25=FACE_BOUND('',#27,.T.);
#26=SPHERICAL_SURFACE('',#16,20.);
#27=VERTEX_LOOP('',#28);
#28=VERTEX_POINT('',#29);
#29=CARTESIAN_POINT('',(0.,0.,-20.));
ENDSEC;
END-ISO-10303-21;
"""


def main(folder: Path) -> None:
    """Write every file below a folder."""
    levels(folder / "levels")
    exports(folder)
    generations(folder / "generated")
    drawing(folder / "cad")
    template(folder / "template")
    print(f"the files are in {folder}")


def levels(folder: Path) -> None:
    """A vase in four levels of detail; the last is too coarse and has lost its material's name."""
    for level, (rows, columns) in enumerate([(64, 64), (36, 40), (20, 24), (6, 8)]):
        material = "Material.001" if level == 3 else "clay"
        save(folder / f"vase_LOD{level}.glb", turned(VASE, rows, columns), material)


def exports(folder: Path) -> None:
    """Three masters, exports that were accepted, and new ones of which one is as it should be."""
    masters = {
        "crate": (boxed(0.5), "wood"),
        "lamp": (turned(LAMP, 40, 32), "brass"),
        "vase": (turned(VASE, 40, 40), "clay"),
    }
    for number, (name, (mesh, material)) in enumerate(masters.items()):
        save(folder / "masters" / f"{name}.glb", mesh, material)
        save(folder / "accepted" / f"{name}.glb", shaken(mesh, 1e-4, seed=number), material)
    crate, lamp, vase = (mesh for mesh, _ in masters.values())
    bare = trimesh.Trimesh(crate.vertices, crate.faces, process=False)
    bare.export(made(folder / "exported" / "crate.glb"))
    large = lamp.copy()
    large.apply_scale(100)
    save(folder / "exported" / "lamp.glb", large, "brass")
    save(folder / "exported" / "vase.glb", shaken(vase, 5e-5, seed=9), "clay")


def generations(folder: Path) -> None:
    """Three answers of a generator: a mug, one with a hole, and one in centimetres."""
    mug = turned(MUG, 48, 32)
    mug.apply_scale(0.1)
    save(folder / "mug_1.glb", mug, "glaze")
    torn = mug.copy()
    torn.update_faces(np.arange(len(torn.faces)) > 40)
    save(folder / "mug_2.glb", torn, "glaze")
    large = mug.copy()
    large.apply_scale(100)
    save(folder / "mug_3.glb", large, "glaze")


def drawing(folder: Path) -> None:
    """The drawing of a ball in millimetres, and a scan of one that has a dent."""
    made(folder / "ball.step").write_text(BALL_STEP)
    ball = trimesh.creation.icosphere(subdivisions=5, radius=20.0)
    reach = np.linalg.norm(ball.vertices - [0.0, 20.0, 0.0], axis=1)
    dent = 0.4 * np.exp(-((reach / 3.0) ** 2))
    noise = np.random.default_rng(0).normal(scale=0.01, size=len(ball.vertices))
    ball.vertices *= (1 + (noise - dent) / 20.0)[:, None]
    ball.export(folder / "scan.ply")


def template(folder: Path) -> None:
    """A head with texture coordinates, and the scan of somebody's, which has a nose."""
    save(made(folder / "head.glb"), turned(HEAD, 32, 40), "skin")
    person = trimesh.creation.icosphere(subdivisions=5)
    x, y, z = person.vertices.T
    nose = 0.18 * np.exp(-((x / 0.16) ** 2 + ((y - 0.05) / 0.25) ** 2)) * (z > 0)
    person.vertices = np.column_stack([0.8 * x, 1.02 * y, 0.93 * z + nose])
    person.export(folder / "person.ply")


def turned(section: tuple[tuple[float, float], ...], rows: int, columns: int) -> trimesh.Trimesh:
    """A surface of revolution around y, with texture coordinates whose seam is one line."""
    points = np.array(section)
    way = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.linspace(0, way[-1], rows + 1)
    radius, height = (np.interp(at, way, points[:, axis]) for axis in (0, 1))
    angle = np.linspace(0, 2 * np.pi, columns + 1)
    angle[-1] = 0.0
    x = radius[:, None] * np.cos(angle)
    z = -radius[:, None] * np.sin(angle)
    y = np.repeat(height, columns + 1)
    mesh = gridded(np.column_stack([x.ravel(), y, z.ravel()]), rows, columns)
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), 1 - at / way[-1])
    mesh.visual = trimesh.visual.TextureVisuals(uv=np.column_stack([u.ravel(), v.ravel()]))
    return mesh


def gridded(points: NDArray[np.float64], rows: int, columns: int) -> trimesh.Trimesh:
    """The triangles of a grid of points, without those whose corners coincide."""
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    above = first + columns + 1
    faces = np.concatenate(
        [np.column_stack([first, first + 1, above + 1]), np.column_stack([first, above + 1, above])]
    )
    corners = points[faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return trimesh.Trimesh(points, faces[area > 1e-12], process=False)


def boxed(size: float) -> trimesh.Trimesh:
    """A box with sides of its own, and texture coordinates on each."""
    box = trimesh.creation.box([size] * 3).subdivide().subdivide()
    box.unmerge_vertices()
    axis = np.abs(box.face_normals).argmax(axis=1).repeat(3)
    flat = np.array(
        [np.delete(point, which) for point, which in zip(box.vertices, axis, strict=True)]
    )
    box.visual = trimesh.visual.TextureVisuals(uv=flat / size + 0.5)
    return box


def shaken(mesh: trimesh.Trimesh, most: float, seed: int) -> trimesh.Trimesh:
    """A copy whose coordinates are off by up to so much, as if they had been rounded."""
    places, which = np.unique(mesh.vertices, axis=0, return_inverse=True)
    shift = np.random.default_rng(seed).uniform(-most, most, places.shape)
    copy = mesh.copy()
    copy.vertices = (places + shift)[which.ravel()]
    return copy


def save(path: Path, mesh: trimesh.Trimesh, material: str) -> None:
    """Write a GLB with a chequered texture under the material's name."""
    squares = np.kron((np.indices((8, 8)).sum(axis=0) % 2) * 90 + 130, np.ones((16, 16)))
    image = Image.fromarray(squares.astype(np.uint8)).convert("RGB")
    looks = PBRMaterial(name=material, baseColorTexture=image, roughnessFactor=0.8)
    copy = mesh.copy()
    copy.visual = trimesh.visual.TextureVisuals(uv=mesh.visual.uv, material=looks)
    trimesh.Scene({path.stem.partition("_LOD")[0]: copy}).export(made(path))


def made(path: Path) -> Path:
    """The path, in a folder that there is."""
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "meshcone-files"))
