"""What may be wrong with whole channels, as a sentence and a remedy."""

from typing import NamedTuple

import numpy as np


class Doubt(NamedTuple):
    """Something wrong with whole channels.

    Attributes:
        kind: What: "reversed torque", "reversed position", "reversed axis", "exchanged torque", "exchanged positions",
            "gravity", "zero", "late", "unit".
        joints: Indices of the joints concerned.
        said: A sentence that names the columns.
        remedy: What would mend it.
        scale: Factors, by column, that would; empty where none do.
        explained: Share of each joint's torque that the model explains once it is mended, shape (n,); None where that
            is not what speaks for it.
    """

    kind: str
    joints: tuple[int, ...]
    said: str
    remedy: str
    scale: dict[str, float]
    explained: np.ndarray | None = None
