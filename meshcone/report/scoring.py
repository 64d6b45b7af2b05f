"""Scoring meshes against the one reference of a job, with the floor beside them."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from meshcone.appearance.comparison import Painted, compare_colours
from meshcone.appearance.paint import Paint
from meshcone.appearance.records import Appearance
from meshcone.gates.rules import GateTable
from meshcone.options import Options, QualityOptions
from meshcone.quality.baselines import project, smooth
from meshcone.quality.conventions import conventions
from meshcone.quality.deviation.bars import bars_of
from meshcone.quality.deviation.proving import ProvenDeviation, prove_deviation
from meshcone.quality.directions import directions, inside
from meshcone.quality.intersections import pass_through_each_other
from meshcone.quality.metrics import compare
from meshcone.quality.parts import Partition, PartSamples, distances_per_part
from meshcone.quality.records import Baselines, Metrics, PerPart, Quality
from meshcone.quality.sampled import SampledSurface, Sampling
from meshcone.quality.validity import inspect
from meshcone.quality.worst_points import worst_points
from meshcone.stopwatch import Stopwatch
from meshcone.surface import Frame, Mesh
from meshcone.surface.arrays import Floats
from meshcone.views.scene import Scene, Surface, spread_to_vertices


class Scorer:
    """A source and its reference, which is sampled once for all that is compared with it.

    Attributes:
        input: the source against the reference.
        floor: the reference against itself, its second set of samples drawn independently.
    """

    def __init__(
        self,
        source: Mesh,
        reference: Mesh,
        options: Options,
        collapsed: tuple[int, int] = (0, 0),
        partitions: tuple[Partition, Partition] | None = None,
    ) -> None:
        """Score the source and find the floor.

        Args:
            source: in the reference's frame.
            reference: in its own frame.
            options: ``quality``, ``deviation``, ``seed`` and ``baselines`` are read.
            collapsed: faces that the files of source and reference list and the meshes do not
                have, because corners of theirs are at one place.
            partitions: the parts of source and reference, if they are to be told apart.
        """
        self._source, self._options = source, options
        self._partitions = partitions
        self._collapsed, collapsed_reference = collapsed
        self._paints: tuple[Paint, Paint] | None = None
        self._watch = Stopwatch()
        self._sampling = sampling_of(options.quality)
        self._reference = self._sampled(reference, self._reference_seed)
        self._input = self._judged = self._sampled(source, options.seed)
        self.input = self._score(self._judged, self._collapsed)
        self._again = self._sampled(reference, options.seed)
        self.floor = self._score(self._again, collapsed_reference)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds each part of the metrics has taken so far, of all meshes together."""
        return dict(self._watch.seconds)

    def refined(self, mesh: Mesh) -> Metrics:
        """Measure the source at other positions; its flipped faces are counted."""
        self._judged = self._sampled(mesh, self._options.seed)
        return self._score(self._judged, self._collapsed, before=self._source)

    def quality(self, refined: Metrics | None, frame: Frame) -> Quality:
        """Put the metric sets beside the floor, the baselines and the conventions.

        Args:
            refined: what :meth:`refined` returned; None where nothing was refined.
            frame: the frame the meshes are in.
        """
        with self._watch.stage("worst_points"):
            worst = worst_points(self._judged, self._reference, frame)
        with self._watch.stage("directions"):
            found = directions(
                self._judged,
                self._reference,
                frame,
                self._options.quality.bound,
                closed=self._closed is not None,
            )
        return Quality(
            input=self.input,
            refined=refined,
            floor=self.floor,
            baselines=self._baselines() if self._options.baselines else None,
            worst_points=worst,
            directions=found,
            per=self._per(frame),
            conventions=conventions(self._sampling, self._options.seed, self._reference_seed),
        )

    def appearance(self, source: Paint, reference: Paint) -> Appearance | None:
        """Compare the colours of the judged mesh with the reference's.

        Args:
            source: the colours of the source's faces, which are the refined mesh's too.
            reference: the colours of the reference's faces.

        Returns:
            None where the options turn it off, or neither file says anything of its colours.
        """
        if not self._options.quality.appearance:
            return None
        self._paints = source, reference
        with self._watch.stage("appearance"):
            return compare_colours(
                Painted(self._judged, source),
                Painted(self._input, source),
                Painted(self._reference, reference),
                self._again,
            )

    def deviation(
        self, frame: Frame, gates: GateTable, tolerance: float = 0.0
    ) -> ProvenDeviation | None:
        """Prove how far the mesh judged last and the reference go from each other.

        Args:
            frame: the frame the meshes are in.
            gates: in the unit of the files; the proof goes on until it has decided them.
            tolerance: how far they may lie from the surfaces that are meant, in the frame.

        Returns:
            None where the options ask for no proof.
        """
        if not self._options.deviation.prove:
            return None
        if not self._options.baselines:  # which are yet to be compared with it
            self._reference.let_go()
        bars = bars_of(gates, frame.radius)
        closed = self._closed
        encloses = None if closed is None else partial(inside, reference=closed)
        with self._watch.stage("deviation"):
            return prove_deviation(
                self._judged,
                self._reference,
                frame,
                self._options.deviation,
                bars,
                encloses,
                tolerance,
                self._is_apart,
            )

    def _is_apart(self) -> bool:
        """Whether the mesh judged last does not pass through the reference."""
        pairs = self._options.quality.intersection_pairs
        judged, reference = self._judged.mesh, self._reference.mesh
        return not pass_through_each_other(judged, reference, pairs)

    def scene(self, frame: Frame, tension: Floats | None = None) -> Scene:
        """What there is to see, with the distances that the metrics have needed anyway.

        Args:
            frame: the frame the meshes are in.
            tension: of each vertex of the refined mesh, (n,).
        """
        judged = _surface(self._judged, self._reference)
        changed = self._judged is not self._input
        return Scene(
            frame=frame,
            input=_surface(self._input, self._reference) if changed else judged,
            refined=judged if changed else None,
            reference=_seen(_surface(self._reference, self._judged), self._judged.mesh),
            tension=tension,
            paints=self._paints,
            parts=self._partitions,
            closed=self._closed,
        )

    @property
    def _reference_seed(self) -> int:
        return self._options.seed + 1

    @property
    def _closed(self) -> Mesh | None:
        """The reference, if it has an inside."""
        validity = self.floor.validity
        oriented = validity.watertight and not validity.opposed_edges
        return self._reference.mesh if oriented else None

    def _per(self, frame: Frame) -> PerPart | None:
        by = self._options.quality.per
        if by is None or self._partitions is None:
            return None
        mine, others = self._partitions
        with self._watch.stage("parts"):
            judged, reference = self._judged, self._reference
            samples = self._options.quality.samples
            return distances_per_part(
                by,
                PartSamples.of(judged.mesh, mine, reference.tree, samples),
                PartSamples.of(reference.mesh, others, judged.tree, samples),
                frame,
                self._options.quality.bound,
                self._closed,
            )

    def _baselines(self) -> Baselines:
        closest_point, laplacian = (
            self._score(
                self._sampled(mesh, self._options.seed), self._collapsed, before=self._source
            )
            for mesh in (project(self._source, self._reference.tree), smooth(self._source))
        )
        return Baselines(closest_point=closest_point, laplacian=laplacian)

    def _score(
        self, surface: SampledSurface, collapsed: int, before: Mesh | None = None
    ) -> Metrics:
        pairs = self._options.quality.intersection_pairs
        with self._watch.stage("validity"):
            validity = inspect(surface.mesh, pairs, before, collapsed)
        found = compare(surface, self._reference, validity, self._watch)
        surface.let_go()
        return found

    def _sampled(self, mesh: Mesh, seed: int) -> SampledSurface:
        with self._watch.stage("sampling"):
            return SampledSurface(mesh, self._sampling, seed)


def sampling_of(chosen: QualityOptions) -> Sampling:
    """Draw as many samples as the options say."""
    return Sampling(
        samples=chosen.samples,
        emd_samples=chosen.emd_samples,
        curvature_samples=min(chosen.curvature_samples, chosen.samples),
        method=chosen.sampling,
    )


def _seen(reference: Surface, beside: Mesh) -> Surface:
    """A reference to look at: triangles that stand for points are as large as their gaps."""
    mesh = reference.mesh
    if not mesh.is_points:
        return reference
    size = np.sqrt(float(beside.face_areas.sum()) / len(mesh.faces))
    centres = mesh.corners.mean(axis=1, keepdims=True)
    offsets = mesh.corners - centres
    vertices = mesh.vertices.copy()
    vertices[mesh.faces] = centres + size * offsets / np.linalg.norm(offsets[0, 0])
    return replace(reference, mesh=Mesh(vertices, mesh.faces))


def _surface(surface: SampledSurface, other: SampledSurface) -> Surface:
    distances = surface.closest_on(other).distances[len(surface.samples.points) :]
    return Surface(surface.mesh, spread_to_vertices(surface.mesh, distances))
