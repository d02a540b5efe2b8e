"""Libraries that only some recordings need."""

import importlib
from typing import Any

from irb140_jax.errors import RecordingError


def library(name: str, what: str) -> Any:
    """An optional library.

    Args:
        name: Of the module.
        what: Who needs it, for the message: "log.bag: ROS bags need rosbags".

    Raises:
        RecordingError: It is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise RecordingError(f"{what}, which is not installed; install it with: pip install 'irb140_jax[logs]'") from (
            error
        )
