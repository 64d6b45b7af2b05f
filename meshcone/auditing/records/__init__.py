"""What an audit says, as data: light enough for a process that reads no mesh.

A field added to one of these models is a value of the report, and a gate, from that day on.
"""

from meshcone.auditing.records.asset import AssetAudit
from meshcone.auditing.records.changes import Changes

__all__ = ["AssetAudit", "Changes"]
