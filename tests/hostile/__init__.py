"""Files made to hurt whoever reads them, each with how it must be refused.

One for each trap known of other readers and for each branch of ours that refuses something.
``CASES`` are small enough to be read anywhere; ``BOMBS`` cost far more than their size where a
cap is missing, and are read in a process whose memory is bounded.
"""

from tests.hostile import documents, foreign, glb, gltf, obj
from tests.hostile.case import Case

CASES: list[Case] = [*obj.CASES, *documents.CASES, *glb.CASES, *gltf.CASES, *foreign.CASES]
BOMBS: list[Case] = [*obj.BOMBS, *documents.BOMBS, *glb.BOMBS, *gltf.BOMBS, *foreign.BOMBS]
