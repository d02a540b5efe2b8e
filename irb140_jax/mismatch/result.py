"""What a diagnosis returns."""

import dataclasses
from typing import Any

from irb140_jax.mismatch.corrected.model import CorrectedModel
from irb140_jax.mismatch.experiment_design.undecided import Undecided


@dataclasses.dataclass(frozen=True)
class Result:
    """A diagnosis.

    Attributes:
        diagnosis: The contract's `diagnosis.json`.
        model: The corrected model, for predictions.
        views: Data for the report's figures.
        undecided: What is open, for the design of a motion that decides it.
    """

    diagnosis: dict[str, Any]
    model: CorrectedModel
    views: dict[str, Any]
    undecided: Undecided
