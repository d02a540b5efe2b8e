"""Units that logs are written in, and what makes SI of them."""

import math
import re

RAD, DEG, REV = 1.0, math.pi / 180, 2 * math.pi
# Factors to SI, by the word one writes in a column map.
UNITS = {
    "rad": RAD, "mrad": 1e-3, "deg": DEG, "rev": REV, "rad/s": RAD, "deg/s": DEG, "rev/s": REV, "rpm": REV / 60,
    "rad/s^2": RAD, "deg/s^2": DEG, "m": 1.0, "mm": 1e-3, "m/s": 1.0, "mm/s": 1e-3, "s": 1.0, "ms": 1e-3, "us": 1e-6,
    "ns": 1e-9, "N m": 1.0, "mN m": 1e-3, "N mm": 1e-3, "N cm": 1e-2, "kN m": 1e3, "N": 1.0, "kN": 1e3,
}  # fmt: skip
# These become torque with a constant of the motor: N m/A, or its rated torque.
CURRENTS = {"A": 1.0, "mA": 1e-3}
SHARES = {"% of rated": 1e-2, "per mille of rated": 1e-3}
OTHER_SPELLINGS = {
    "°": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "°/s": "deg/s", "dps": "deg/s",
    "rps": "rev/s", "1/min": "rpm", "u/min": "rpm", "min^-1": "rpm", "turn": "rev", "turns": "rev", "revs": "rev",
    "rad/s²": "rad/s^2", "deg/s²": "deg/s^2", "°/s²": "deg/s^2", "rad/s2": "rad/s^2", "deg/s2": "deg/s^2",
    "sec": "s", "second": "s", "seconds": "s", "msec": "ms", "usec": "us", "µs": "us", "μs": "us", "nsec": "ns",
    "nm": "N m", "n·m": "N m", "n*m": "N m", "n.m": "N m", "mnm": "mN m", "mn·m": "mN m", "nmm": "N mm", "ncm": "N cm",
    "knm": "kN m", "amp": "A", "amps": "A", "ampere": "A", "a": "A", "ma": "mA", "n m": "N m", "mn m": "mN m",
    "%": "% of rated", "‰": "per mille of rated",
}  # fmt: skip
# Units of channels that no joint has; they make a row of units recognisable.
FOREIGN = {"", "-", "1", "c", "°c", "degc", "k", "v", "mv", "w", "hz", "bool", "counts", "count", "inc", "ticks", "nan"}


def known_unit(text: str) -> str | None:
    """The unit as a column map writes it, or None: "Nm", "[°]", "(mA)" are known."""
    word = text.strip().strip("[]()").strip()
    for unit in (*UNITS, *CURRENTS, *SHARES):
        if word == unit:
            return unit
    return OTHER_SPELLINGS.get(word.casefold())


def is_unit(text: str) -> bool:
    """Whether a field below the header can be a unit."""
    return known_unit(text) is not None or text.strip().strip("[]()").strip().casefold() in FOREIGN


def stated_unit(name: str) -> str | None:
    """The unit in brackets at the end of a column's name, as in "Axis 1 [deg]"."""
    bracket = re.search(r"[\[(]([^\[\]()]+)[\])]\s*$", name)
    return known_unit(bracket.group(1)) if bracket else None
