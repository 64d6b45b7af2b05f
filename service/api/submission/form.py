"""The form that submits a job, as the API's description shows it."""

from __future__ import annotations

from typing import Any

from service.api.downloads import BYTES
from service.api.request_schemas import LABEL_LENGTH
from service.api.submission.parts import MAX_LABELS
from worker.outbound.addresses import URL_LENGTH

_BLOB = {
    "type": "string",
    "contentMediaType": "application/json",
    "contentSchema": {"$ref": "#/components/schemas/NamedBlob"},
    "description": 'a file sent before: {"name": "mug.glb", "sha256": "…"}',
}
_LINK = {
    "type": "string",
    "contentMediaType": "application/json",
    "contentSchema": {"$ref": "#/components/schemas/LinkedFile"},
    "description": 'a file to fetch: {"url": "https://assets.example.org/mug.glb"}',
}


def _files(description: str) -> dict[str, Any]:
    return {"type": "array", "items": {"anyOf": [BYTES, _BLOB, _LINK]}, "description": description}


def _file(description: str) -> dict[str, Any]:
    return {"anyOf": [BYTES, _BLOB, _LINK], "description": description}


SUBMISSION_FORM: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "application/json": {"schema": {"$ref": "#/components/schemas/JobRequest"}},
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["source"],
                    "properties": {
                        "source": _file("the mesh to refine, as a file, by its hash or by its URL"),
                        "reference": _file(
                            "the mesh to refine it towards; only the mode audit can do without"
                        ),
                        "options": {
                            "type": "string",
                            "contentMediaType": "application/json",
                            "contentSchema": {"$ref": "#/components/schemas/Options"},
                            "description": "a JSON object; without it, the defaults are used",
                        },
                        "source_resources": _files(
                            "files that the source names (buffers, materials), a field each"
                        ),
                        "reference_resources": _files("files that the reference names"),
                        "resources": _files(
                            "files that both name; none may have the name of one that is sent "
                            "for the source or for the reference alone"
                        ),
                        "label": {
                            "type": "array",
                            "items": {"type": "string", "maxLength": LABEL_LENGTH},
                            "maxItems": MAX_LABELS,
                            "description": "names to find the job by, a field each",
                        },
                        "outputs": {
                            "type": "string",
                            "contentMediaType": "application/json",
                            "contentSchema": {
                                "type": "object",
                                "additionalProperties": {
                                    "$ref": "#/components/schemas/OutputPlace"
                                },
                            },
                            "description": "where to put what the job makes: "
                            '{"mesh": {"url": "https://…"}}',
                        },
                        "webhook": {
                            "type": "string",
                            "format": "uri",
                            "maxLength": URL_LENGTH,
                            "description": "where to say that the job has ended, signed as "
                            "standardwebhooks.com describes",
                        },
                    },
                    "additionalProperties": False,
                }
            },
        },
    }
}
