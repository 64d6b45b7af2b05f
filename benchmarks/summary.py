"""Tables of a comparison: one per degradation, with the exceptions named below."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from comparison import Row
from methods import PEERS
from rich.console import Console
from rich.table import Table

_ASPECT_LIMIT = 1.05
# Median, 90th percentile and worst that the engine is to stay below, over the 59 real shapes.
WANTED = {
    "noise_2": (0.021, 0.05, 0.25),
    "noise_05": (0.034, 0.055, 0.10),
    "spikes": (0.018, 0.09, 0.25),
    "smoothing": (0.0055, 0.03, 0.10),
    "decimation": (0.108, 0.24, 0.70),
    "marching_cubes": (0.028, 0.09, 0.63),
}
_NAMED = 12  # exceptions listed by name, worst first


def as_record(row: Row) -> dict[str, Any]:
    """A row as JSON, with what follows from its measures."""
    derived = {
        "ratio": row.ratio,
        "aspect_change": row.aspect_change,
        "aspect_excess": row.aspect_excess,
    }
    return asdict(row) | {name: value for name, value in derived.items() if np.isfinite(value)}


def summarise(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """One record for each degradation and method, in the order of the rows."""
    keys = dict.fromkeys((row.degradation, row.method) for row in rows)
    return [
        _summary([row for row in rows if (row.degradation, row.method) == key], rows)
        for key in keys
    ]


def print_summaries(summaries: Iterable[dict[str, Any]], console: Console) -> None:
    """Print the tables."""
    records = list(summaries)
    for degradation in dict.fromkeys(record["degradation"] for record in records):
        chosen = [record for record in records if record["degradation"] == degradation]
        console.print(_table(degradation, chosen))
        for record in chosen:
            for line in _exceptions(record):
                console.print(line, highlight=False, soft_wrap=True)
        console.print()


def print_totals(rows: Sequence[Row], console: Console) -> None:
    """Print a line for each of the engine's settings, over all degradations."""
    for method in dict.fromkeys(row.method for row in rows if row.method not in PEERS):
        done = [row for row in rows if row.method == method and row.after is not None]
        console.print(
            f"{method}: of {len(done)} answers {sum(bool(row.harm) for row in done)} harm their "
            "input, "
            f"{sum(row.returned for row in done)} are the input, "
            f"{sum(row.ratio > 1 for row in done)} are farther away than it; "
            f"{sum(row.flipped for row in done)} faces turned over, "
            f"{sum(row.crossings or 0 for row in done)} pairs of faces pass through each other "
            f"that did not; {sum(row.seconds for row in done):.0f} s",
            highlight=False,
            soft_wrap=True,
        )


def _summary(rows: Sequence[Row], everything: Sequence[Row]) -> dict[str, Any]:
    done = [row for row in rows if row.after is not None]
    record: dict[str, Any] = {
        "degradation": rows[0].degradation,
        "method": rows[0].method,
        "shapes": len(done),
        "skipped": sum(row.after is None and not row.failed for row in rows),
        "failed": {row.shape: row.trouble for row in rows if row.failed},
    }
    if not done:
        return record
    ratios = np.array([row.ratio for row in done])
    return record | {
        "median": float(np.median(ratios)),
        "p90": float(np.quantile(ratios, 0.9)),
        "worst": float(ratios.max()),
        "worst_shape": done[int(ratios.argmax())].shape,
        "normals": float(np.median([row.after.normals for row in done if row.after])),
        "aspect_change": max(row.aspect_change for row in done),
        "aspect_excess": max(row.aspect_excess for row in done),
        "aspect_over": _by_size({r.shape: r.aspect_change for r in done}, _ASPECT_LIMIT),
        "aspect_excess_over": _by_size({r.shape: r.aspect_excess for r in done}, _ASPECT_LIMIT),
        "flipped": _by_size({row.shape: row.flipped for row in done}, 0),
        "worse_than_input": _by_size({row.shape: row.ratio for row in done}, 1),
        "crossings": _by_size({row.shape: row.crossings or 0 for row in done}, 0),
        "returned": [row.shape for row in done if row.returned],
        "harmed": {row.shape: row.harm for row in done if row.harm},
        "beaten": {} if rows[0].method in PEERS else _beaten(done, everything),
        "seconds_median": float(np.median([row.seconds for row in done])),
        "seconds": sum(row.seconds for row in done),
    }


def _by_size(values: dict[str, Any], above: float) -> dict[str, Any]:
    chosen = [(name, value) for name, value in values.items() if value > above]
    return dict(sorted(chosen, key=lambda item: -item[1]))


def _beaten(done: Sequence[Row], everything: Sequence[Row]) -> dict[str, list[str]]:
    beaten = {
        ours.shape: [
            peer.method
            for peer in everything
            if peer.method in PEERS
            and (peer.shape, peer.degradation) == (ours.shape, ours.degradation)
            and peer.beats(ours)
        ]
        for ours in done
    }
    return {shape: peers for shape, peers in beaten.items() if peers}


def _table(degradation: str, records: Iterable[dict[str, Any]]) -> Table:
    table = Table(title=f"{degradation}: point-to-surface distance, refined over input")
    table.add_column("method")
    for title in ("shapes", "median", "p90", "worst"):
        table.add_column(title, justify="right")
    table.add_column("worst on")
    for title in (
        "normals",
        "aspect",
        "excess",
        "flips",
        "crossings",
        "worse",
        "harmed",
        "beaten",
        "s",
        "not run",
    ):
        table.add_column(title, justify="right")
    for record in records:
        table.add_row(*_cells(record))
    table.add_row("wanted", "", *(f"{bound:.3f}" for bound in WANTED[degradation]))
    return table


def _cells(record: dict[str, Any]) -> list[str]:
    not_run = str(record["skipped"] + len(record["failed"]))
    if not record["shapes"]:
        return [record["method"], "0", *["-"] * 13, not_run]
    flips = record["flipped"]
    return [
        record["method"],
        str(record["shapes"]),
        *(f"{record[name]:.3f}" for name in ("median", "p90", "worst")),
        record["worst_shape"],
        *(f"{record[name]:.3f}" for name in ("normals", "aspect_change", "aspect_excess")),
        f"{sum(flips.values())} on {len(flips)}",
        f"{sum(record['crossings'].values())} on {len(record['crossings'])}",
        str(len(record["worse_than_input"])),
        str(len(record["harmed"])),
        "-" if record["method"] in PEERS else str(len(record["beaten"])),
        f"{record['seconds_median']:.2f}",
        not_run,
    ]


def _exceptions(record: dict[str, Any]) -> Iterable[str]:
    who = f"  {record['method']}:"
    for shape, trouble in record["failed"].items():
        yield f"{who} failed on {shape}: {trouble}"
    if record["method"] in PEERS or not record["shapes"]:
        return
    for label, key in (
        ("worse than its input", "worse_than_input"),
        (f"aspect ratio over {_ASPECT_LIMIT} of the input's", "aspect_over"),
        (f"aspect ratio over {_ASPECT_LIMIT} of input's and reference's", "aspect_excess_over"),
        ("flipped faces", "flipped"),
        ("pairs of faces that pass through each other now", "crossings"),
    ):
        if record[key]:
            yield f"{who} {label}: {_named(record[key])}"
    for shape, reasons in record["harmed"].items():
        yield f"{who} harmed {shape}: {'; '.join(reasons)}"
    if record["returned"]:
        yield f"{who} returned as they came: {', '.join(record['returned'])}"
    if record["beaten"]:
        pairs = [f"{shape} ({', '.join(peers)})" for shape, peers in record["beaten"].items()]
        yield f"{who} a peer is nearer and has better normals: {'; '.join(pairs)}"


def _named(values: dict[str, Any]) -> str:
    listed = [
        f"{shape} {value if isinstance(value, int) else format(value, '.3f')}"
        for shape, value in list(values.items())[:_NAMED]
    ]
    more = len(values) - len(listed)
    return ", ".join(listed) + (f" and {more} more" if more else "")
