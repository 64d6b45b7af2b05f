"""Files of design programs, written by hand."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Iterable, Mapping, Sequence

_HEADER = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('made by a test','2020-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
#1=APPLICATION_CONTEXT('core data for automotive mechanical design processes');
#2=APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#1);
#3=PRODUCT_CONTEXT('',#1,'mechanical');
#4=PRODUCT('part','part','',(#3));
#5=PRODUCT_DEFINITION_FORMATION('','',#4);
#6=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#7=PRODUCT_DEFINITION('design','',#5,#6);
#8=PRODUCT_DEFINITION_SHAPE('','',#7);
#10=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#11=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#12=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#9,'distance_accuracy_value','');
#13=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#12))
GLOBAL_UNIT_ASSIGNED_CONTEXT((#9,#10,#11))REPRESENTATION_CONTEXT('',''));
#14=SHAPE_DEFINITION_REPRESENTATION(#8,#15);
#15=ADVANCED_BREP_SHAPE_REPRESENTATION('',(#16,#17),#13);
#16=AXIS2_PLACEMENT_3D('',#18,#19,#20);
#18=CARTESIAN_POINT('',(0.,0.,0.));
#19=DIRECTION('',(0.,0.,1.));
#20=DIRECTION('',(1.,0.,0.));
"""
_MILLIMETRE = "#9=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));\n"
_INCH = """#9=(CONVERSION_BASED_UNIT('INCH',#91)LENGTH_UNIT()NAMED_UNIT(#93));
#91=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#92);
#92=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#93=DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);
"""


def step_ball(radius: float = 20.0, *, inches: bool = False) -> bytes:
    """A STEP file of one sphere around the origin: a solid with a single face."""
    body = f"""#17=MANIFOLD_SOLID_BREP('ball',#21);
#21=CLOSED_SHELL('',(#22));
#22=ADVANCED_FACE('',(#23),#24,.T.);
#23=FACE_BOUND('',#25,.T.);
#24=SPHERICAL_SURFACE('',#16,{radius!r});
#25=VERTEX_LOOP('',#26);
#26=VERTEX_POINT('',#27);
#27=CARTESIAN_POINT('',(0.,0.,{-radius!r}));
"""
    unit = _INCH if inches else _MILLIMETRE
    return f"{_HEADER}{unit}{body}ENDSEC;\nEND-ISO-10303-21;\n".encode()


Object = tuple[Sequence[Sequence[float]], Sequence[Sequence[int]]]


def three_mf(objects: Sequence[Object], items: Iterable[tuple[int, str | None]]) -> bytes:
    """A 3MF of some meshes.

    Args:
        objects: vertices and triangles of each.
        items: what is built: the number of an object, and where it is put, if anywhere else.
    """
    from tests.archives import packed

    resources = ""
    for number, (vertices, faces) in enumerate(objects, 1):
        points = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in vertices)
        corners = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces)
        resources += (
            f'<object id="{number}" name="part {number}" type="model"><mesh>'
            f"<vertices>{points}</vertices><triangles>{corners}</triangles></mesh></object>"
        )
    build = "".join(
        f'<item objectid="{number}"{f" transform={chr(34)}{place}{chr(34)}" if place else ""}/>'
        for number, place in items
    )
    model = (
        '<?xml version="1.0" encoding="UTF-8"?><model unit="millimeter" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )
    types = (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
        '<Default Extension="rels" '
        'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model" '
        'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
    )
    links = (
        '<?xml version="1.0" encoding="UTF-8"?>'
        '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
        'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
    )
    return packed(
        {
            "[Content_Types].xml": types.encode(),
            "_rels/.rels": links.encode(),
            "3D/3dmodel.model": model.encode(),
        }
    )


QUAD = """
    def Mesh "quad"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    }
"""


def usda(*prims: str, metadata: str = "", above: str = "") -> bytes:
    """A USD file as text.

    Args:
        prims: what is below a node that moves it by (10, 0, 0).
        metadata: of the stage.
        above: members of that node.
    """
    text = f"""#usda 1.0
({metadata})
def Xform "top"
{{
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    {above}
{"".join(prims)}
}}
"""
    return text.encode()


def usdz(files: Mapping[str, bytes]) -> bytes:
    """A USDZ: an archive whose files are stored, each at a multiple of 64 bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, (2020, 2, 2, 20, 20, 20))
            room = -(out.tell() + 34 + len(name)) % 64
            entry.extra = struct.pack("<2H", 0x1986, room) + bytes(room)
            archive.writestr(entry, content)
    return out.getvalue()
