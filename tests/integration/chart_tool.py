"""What Helm and the schemas of Kubernetes say of a chart, as JSON.

    python chart_tool.py CHART < values.json

It runs in an environment of its own (`make chart`): Helm's SDK takes 240 MB, the schemas 110 MB.
Its input is a list of values; its output has what ``helm lint --strict`` finds and, for each
values, the manifests of ``helm template`` with what their schemas say of them, or why there are
none.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from typing import Any

import kubernetes_validate
import yaml
from helm_python import chart
from helm_python.errors import HelmError

VERSIONS = ("1.29", "1.37")  # of Kubernetes: the least that the chart accepts, and a new one
_OTHERS = ("keda.sh/v1alpha1",)  # whose schemas are not Kubernetes' own


def main() -> None:
    """Read values, print what was found."""
    path = sys.argv[1]
    loaded = chart.Chart.load(path)
    many = json.load(sys.stdin)
    found = {
        "lint": chart.lint(path, many[0], strict=True),
        "rendered": [_rendered(loaded, values) for values in many],
    }
    json.dump(found, sys.stdout)


def _rendered(loaded: chart.Chart, values: dict[str, Any]) -> dict[str, Any]:
    try:
        loaded.validate_schema(values)
        files = loaded.render(values, name="prod", namespace="assets")
    except HelmError as error:
        return {"error": str(error), "manifests": [], "faults": []}
    manifests = [
        manifest
        for name, text in sorted(files.items())
        if name.endswith(".yaml")
        for manifest in yaml.safe_load_all(text)
        if manifest
    ]
    faults = [fault for manifest in manifests for fault in _faults(manifest)]
    notes = [text for name, text in files.items() if name.endswith("NOTES.txt")]
    return {"error": None, "manifests": manifests, "faults": faults, "notes": notes}


def _faults(manifest: dict[str, Any]) -> Iterator[str]:
    for version in VERSIONS if manifest["apiVersion"] not in _OTHERS else ():
        try:
            kubernetes_validate.validate(manifest, version, strict=True)
        except kubernetes_validate.ValidationError as error:
            yield f"{version}, {manifest['kind']} {manifest['metadata']['name']}: {error.message}"


if __name__ == "__main__":
    main()
