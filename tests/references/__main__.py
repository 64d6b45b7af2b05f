"""``python -m tests.references`` writes the parts of docs/ that are made of the code."""

from tests.references.parts import DOCS, renewed

for document in sorted(DOCS.glob("*.md")):
    document.write_text(renewed(document.read_text()))
