"""What the tool carried in some recordings, as the command line says it."""

import math
import pathlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

from irb140_jax.errors import InputError

if TYPE_CHECKING:
    from irb140_jax.recordings import Payload


def known_payloads(words: Sequence[str], recordings: Sequence[pathlib.Path]) -> "dict[pathlib.Path, Payload]":
    """Known payloads by recording, from words such as "loaded.csv=2.5" or "loaded.csv=2.5@0,0,0.05".

    Args:
        words: A recording, its payload's mass [kg], and where that sits beside the tool [m].
        recordings: All that are diagnosed: by their path, or by name where that is one recording's alone.

    Raises:
        InputError: A word of another kind, a recording that is none of these, or one twice.
    """
    out: dict[pathlib.Path, Payload] = {}
    for word in words:
        name, payload = _parsed(word)
        mine = [r for r in recordings if name in (str(r), r.name)]
        if len(mine) != 1 or mine[0] in out:
            raise InputError(
                f"--known-payload {word}: {name!r} has to be one of the recordings, once each; these are "
                f"{', '.join(map(str, recordings))}"
            )
        out[mine[0]] = payload
    return out


def _parsed(word: str) -> "tuple[str, Payload]":
    from irb140_jax.recordings import Payload

    name, _, numbers = word.rpartition("=")
    mass, _, place = numbers.partition("@")
    try:
        at = tuple(map(float, place.split(","))) if place else (0.0, 0.0, 0.0)
        if not name or len(at) != 3 or not 0.0 < float(mass) < math.inf or not all(map(math.isfinite, at)):
            raise ValueError
        return name, Payload(float(mass), at)
    except ValueError:
        raise InputError(
            f"--known-payload {word}: allowed is a recording and a mass above 0 [kg], with where it sits beside the "
            "tool [m] if not there, as in --known-payload loaded.csv=2.5 or --known-payload loaded.csv=2.5@0,0,0.05"
        ) from None
