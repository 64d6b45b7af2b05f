"""The two files of a job, read, placed in the reference's frame and described."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from meshcone.appearance.paint import Paint
from meshcone.assets import Asset, read_asset
from meshcone.assets.points.asset import points_alone
from meshcone.assets.policy import ReadPolicy, WritePolicy
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.fitting import require_units
from meshcone.gates.rules import GateTable
from meshcone.gates.units import Unit, sized, unit_for
from meshcone.notices import Code, Notice, Side, Told, WarningRecord
from meshcone.options import Options
from meshcone.quality.parts import Partition
from meshcone.quality.records import Division, Validity
from meshcone.report.data_checks import data_warnings
from meshcone.report.report import AlignmentRecord, FrameRecord, InputRecord, Inputs
from meshcone.surface import Frame, Mesh, Subdivision
from meshcone.surface.alignment import Alignment, AlignmentMode, align
from meshcone.surface.arrays import Bools, Floats, row_lengths
from meshcone.surface.similarity import invert, rounding_of, scale_of, transform_points


@dataclass(frozen=True)
class Pair:
    """A source and its reference.

    Attributes:
        source_file, reference_file: as sent.
        source_asset, reference_asset: as read.
        source, reference: their welded surfaces in the frame.
        frame: the similarity into the reference's unit sphere.
        alignment: how the source was brought to the reference first, if it was; the file
            that is written stays where the source was.
        policy: how the source is written back; None if it is not.
        reading: what of the source's file is read.
    """

    source_file: MeshFile
    reference_file: MeshFile
    source_asset: Asset
    reference_asset: Asset
    source: Mesh
    reference: Mesh
    frame: Frame
    alignment: Alignment | None = None
    policy: WritePolicy | None = None
    reading: ReadPolicy = field(default_factory=ReadPolicy)

    def under(self, options: Options) -> Pair:
        """Settle how the source will be written, and what of it may move.

        Raises:
            InputError: the file has no part of a name that is asked for, or cannot be written.
        """
        policy = self.source_asset.policy(options)
        self.source_asset.ensure_writable(policy)
        return replace(self, policy=policy)

    @property
    def fixed(self) -> Bools:
        """(n,) which vertices of the source may not move, for lack of being selected."""
        policy = self.policy or WritePolicy()
        return policy.fixed_vertices(self.source.faces, len(self.source.vertices))

    @property
    def collapsed(self) -> tuple[int, int]:
        """Faces of source and reference that have corners at one place, and so no part here."""
        return self.source_asset.collapsed, self.reference_asset.collapsed

    @property
    def tolerance(self) -> float:
        """How far the surfaces may lie from those that the files mean, relative to the radius.

        A source far from the origin is rounded on its way to the reference.
        """
        source, reference = self.source_asset, self.reference_asset
        found = source.tolerance
        if self.alignment is not None:
            matrix = self.alignment.matrix
            found = scale_of(matrix) * found + rounding_of(matrix, source.vertices)
        return (found + reference.tolerance) / self.frame.radius

    def aligned(self, mode: AlignmentMode, seed: int) -> Pair:
        """Bring the source to the reference, rigidly or by a similarity."""
        here, there = self.in_model_units()
        return self.placed(align(here, there, mode, seed))

    def in_model_units(self) -> tuple[Mesh, Mesh]:
        """The surfaces of source and reference outside the frame."""
        source, reference = (
            mesh.moved_to(self.frame.out_of(mesh.vertices), self.frame.radius)
            for mesh in (self.source, self.reference)
        )
        return source, reference

    def placed(self, alignment: Alignment) -> Pair:
        """Move the source by an alignment that is known."""
        unplaced = _in_frame(self.frame, self.source_asset)
        moved = transform_points(alignment.matrix, self.source_asset.vertices)
        source = unplaced.moved_to(self.frame.into(moved), scale_of(alignment.matrix))
        return replace(self, source=source, alignment=alignment)

    @property
    def divisible(self) -> Bools:
        """(m,) which faces of the source may be divided: those that are selected."""
        selected = self.policy.selected if self.policy is not None else None
        return np.ones(len(self.source.faces), dtype=bool) if selected is None else selected

    def divided(self, subdivision: Subdivision, options: Options) -> Pair:
        """Divide the faces of the source where they are, and place it as it is placed here.

        The file that was sent stays what it was; what is written from now on is a copy of the
        divided one.

        Args:
            subdivision: of the source's faces.
            options: which say how that is written, and what of it may move.

        Raises:
            InputError, LimitError: it cannot be divided, is too large for a limit, or is not read
                as the faces that were asked for.
        """
        asset = self.read_patched(self.source_asset.divided(subdivision))
        added = len(subdivision.parents) - subdivision.sources
        if len(asset.triangles) != len(self.source_asset.triangles) + added:
            raise InputError("the divided file is read as other faces", file=asset.name)
        source = _in_frame(self.frame, asset)
        pair = replace(self, source_asset=asset, source=source).under(options)
        return pair if self.alignment is None else pair.placed(self.alignment)

    def gates(self, options: Options) -> GateTable:
        """The options' gates, with their bounds on distances in the unit of the files."""
        formats = self._sized(options)
        return {
            key: rule.in_model_units(unit_for(rule.unit, *formats).length)
            for key, rule in options.gates.items()
        }

    def require_units(self, options: Options) -> None:
        """Check that lengths of the options' gates can be held against these files.

        Raises:
            InputError: a gate is in a unit that is no length, where the files have one.
        """
        formats = (self.source_asset.format, self.reference_asset.format)
        require_units(options.gates, *formats, scaled=options.align == "similarity")

    def unit(self, options: Options) -> Unit:
        """What distances are told in: as a gate calls it, metres for a glTF, or "units"."""
        named = next((rule.unit for rule in options.gates.values() if rule.unit), None)
        return unit_for(named, *self._sized(options))

    def _sized(self, options: Options) -> tuple[str, ...]:
        scaled = options.align == "similarity"
        return sized(self.source_asset.format, self.reference_asset.format, scaled=scaled)

    def alignment_record(self) -> AlignmentRecord | None:
        """Describe the alignment for a report."""
        found = self.alignment
        if found is None:
            return None
        return AlignmentRecord(
            matrix=found.matrix.tolist(),
            method=found.method,
            before=found.before,
            after=found.after,
            note=found.note,
        )

    def inputs(self, source: Validity, reference: Validity) -> Inputs:
        """Describe both files for a report, with what was counted on their meshes."""
        return Inputs(
            source=describe(self.source_file, self.source_asset, source),
            reference=describe(self.reference_file, self.reference_asset, reference),
        )

    def frame_record(self) -> FrameRecord:
        """Describe the frame for a report."""
        x, y, z = map(float, self.frame.centre)
        return FrameRecord(centre=(x, y, z), radius=self.frame.radius)

    @property
    def paints(self) -> tuple[Paint, Paint]:
        """The colours of source and reference."""
        return Paint(self.source_asset), Paint(self.reference_asset)

    def partitions(self, by: Division) -> tuple[Partition, Partition]:
        """The parts of source and reference."""
        return Partition(*self.source_asset.parts(by)), Partition(*self.reference_asset.parts(by))

    def measured_parts(self, options: Options) -> tuple[Partition, Partition] | None:
        """The parts whose metrics are asked for one by one; None where they are not."""
        by = options.quality.per
        return self.partitions(by) if by else None

    def warnings(self, source: Validity, reference: Validity, written: Asset | None = None) -> Told:
        """Collect what the readers had to say, and what the pair suggests may be wrong with it.

        Args:
            source: what was counted on the source.
            reference: what was counted on the reference.
            written: the refined file, if one was written.
        """
        sides: tuple[tuple[Side, Asset], ...] = (
            ("source", self.source_asset),
            ("reference", self.reference_asset),
        )
        told = [
            notice.about(side, asset.name) for side, asset in sides for notice in asset.warnings
        ]
        found = data_warnings(
            self.source, self.reference, source, reference, self.frame, self.partitions("node")
        )
        return Told(told + self._writing(written)) + found

    def _writing(self, written: Asset | None) -> list[WarningRecord]:
        """What of the source stays although it could move, and what is changed besides."""
        if self.policy is None or written is None:
            return []
        told = list(self.source_asset.changes(self.policy, written))
        selected = self.policy.selected
        if selected is not None:
            fixed = self.fixed
            words = (
                f"{np.count_nonzero(selected):,} of {len(selected):,} faces are selected; "
                f"{np.count_nonzero(fixed):,} of {len(fixed):,} vertices belong to others and stay"
            )
            told.append(Notice(Code.WRITING_SELECTED, words))
        return [notice.about("source", self.source_asset.name) for notice in told]

    def patched(self, positions: Floats) -> bytes:
        """Write the source file with its vertices at (n, 3) positions in the frame.

        A vertex that is where the frame puts the source's own keeps its coordinates to the
        last bit, which the way into the frame and back would not.

        Raises:
            InputError: the format, or something in this file, cannot be written back.
        """
        model = self.frame.out_of(positions)
        if self.alignment is not None:
            model = transform_points(invert(self.alignment.matrix), model)
        stayed = (positions == self.source.vertices).all(axis=1)
        model = np.where(stayed[:, None], self.source_asset.vertices, model)
        return self.source_asset.patched(model, self.policy or WritePolicy())

    def read_patched(self, data: bytes) -> Asset:
        """Read a patched copy of the source file.

        Raises:
            InputError, LimitError: it cannot be read.
        """
        name, beside = self.source_asset.name, self.source_file.resources
        return read_asset(name, data, beside, policy=self.reading)

    def opened(self, written: Asset) -> float:
        """Measure how far a patched copy opens triangles that are not faces of the source.

        Such a triangle has two corners at one place. It has no area as long as two still are.

        Returns:
            The largest of these triangles' shortest sides, in model units.
        """
        asset = self.source_asset
        left_out = np.delete(asset.triangles, asset.kept, axis=0)
        corners = written.positions[left_out]
        sides = row_lengths((corners - np.roll(corners, 1, axis=1)).reshape(-1, 3))
        widest = float(sides.reshape(-1, 3).min(axis=1).max(initial=0.0))
        return widest if self.alignment is None else widest * scale_of(self.alignment.matrix)


def read_pair(source: MeshFile, reference: MeshFile, options: Options) -> Pair:
    """Read both files.

    Args:
        source: the mesh.
        reference: what it should have been.
        options: what of the files is read.

    Raises:
        InputError, LimitError: from the readers, or a surface without area.
    """
    reading = ReadPolicy.of_source(options)
    source_asset, reference_asset = (
        read_asset(file.name, file.data, file.resources, policy=policy)
        for file, policy in ((source, reading), (reference, ReadPolicy.of_reference(options)))
    )
    if source_asset.is_points:
        raise points_alone(source_asset.name)
    model = Mesh(reference_asset.vertices, reference_asset.faces, reference_asset.is_points)
    for asset, mesh in (
        (source_asset, Mesh(source_asset.vertices, source_asset.faces)),
        (reference_asset, model),
    ):
        if not mesh.face_areas.sum() > 0:
            raise InputError("every face is without area", file=asset.name)
    frame = Frame.of(model)
    return Pair(
        source_file=source,
        reference_file=reference,
        source_asset=source_asset,
        reference_asset=reference_asset,
        source=_in_frame(frame, source_asset),
        reference=_in_frame(frame, reference_asset),
        frame=frame,
        reading=reading,
    )


def _in_frame(frame: Frame, asset: Asset) -> Mesh:
    """Bring the surface of a file into the frame, with the precision of its numbers."""
    precision = asset.precision / frame.radius
    return Mesh(frame.into(asset.vertices), asset.faces, asset.is_points, precision)


def describe(file: MeshFile, asset: Asset, validity: Validity) -> InputRecord:
    """Describe a file for a report, with what was counted on its mesh."""
    counts = asset.counts()
    return InputRecord(
        name=asset.name,
        format=asset.format,
        member=None if asset.packed is None else asset.packed.mesh.name,
        tolerance=asset.tolerance or None,
        sha256=file.sha256,
        resources=file.resource_hashes,
        bytes=len(file.data),
        vertices=counts.vertices,
        welded_vertices=counts.welded_vertices,
        faces=counts.faces,
        polygons=counts.polygons,
        meshes=counts.meshes,
        materials=counts.materials,
        validity=validity,
    )
