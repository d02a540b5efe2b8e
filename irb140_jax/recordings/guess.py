"""Which column is which joint's which quantity, guessed from its name.

A name is cut into words and numbers; the words tell the quantity and whether it was measured or commanded, what is left
tells the joint.  A guess is a place to start from: a person reads the map that is written from it.
"""

import dataclasses
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping

from irb140_jax.recordings.units import known_unit, stated_unit

WORDS = {
    "qdd": {"qdd", "ddq", "acc", "accel", "acceleration", "beschleunigung"},
    "qd": {"qd", "dq", "qdot", "vel", "velo", "velocity", "velocities", "speed", "omega", "geschwindigkeit"},
    "tau": {"tau", "torque", "torques", "trq", "tq", "effort", "efforts", "moment", "drehmoment",
            "current", "curr", "cur", "amps", "iq", "strom", "load"},
    "q": {"q", "pos", "position", "positions", "angle", "ang", "theta", "winkel", "state"},
}  # fmt: skip
CURRENT = {"current", "curr", "cur", "amps", "iq", "strom"}
TORQUE = WORDS["tau"] - CURRENT - {"load"}
COMMANDED = {
    "des", "desired", "target", "cmd", "command", "commanded", "ref", "reference", "set", "setpoint", "goal", "sp",
    "action", "con", "ctrl", "control", "soll", "nominal", "plan", "planned", "qdes", "qref", "qcmd",
}  # fmt: skip
MEASURED = {"act", "actual", "meas", "measured", "feedback", "fbk", "fb", "state", "ist", "real", "observation"}
FILTERED = {"filt", "filtered", "smooth", "smoothed", "estimated", "est"}
# Of another thing than a joint's motion or torque.
FOREIGN = {
    "fric", "friction", "grav", "gravity", "error", "err", "limit", "max", "min", "std", "temp", "temperature", "tcp",
    "cart", "cartesian", "voltage", "fault", "flag", "status", "mode", "index", "complete", "task", "gripper", "model",
    "ff", "feedforward", "external", "ext", "x", "y", "z", "rx", "ry", "rz",
}  # fmt: skip
GENERIC = {"joint", "joints", "axis", "axes", "ax", "achse", "j", "a", "motor", "link", "states", "robot", "arm", "as"}
TIME = {"t", "time", "timestamp", "stamp", "zeit", "elapsed", "seconds", "clock", "datetime", "date"}
UNITS_OF = {
    "rad": "q", "deg": "q", "rev": "q", "mrad": "q", "rad/s": "qd", "deg/s": "qd", "rev/s": "qd", "rpm": "qd",
    "N m": "tau", "mN m": "tau", "N mm": "tau", "A": "tau", "mA": "tau", "% of rated": "tau",
    "per mille of rated": "tau",
}  # fmt: skip
SUFFIX_UNITS = {"deg", "degrees", "rad", "nm", "rpm", "amps", "ma", "ms", "us", "ns", "sec", "s", "percent", "pct"}


@dataclasses.dataclass(frozen=True)
class Meaning:
    """What the name of a column says.

    Attributes:
        column: Its name in the file.
        quantity: q, qd, qdd, tau or qdes.
        joint: The joint's name in the robot, or what the name itself says: a word, a number, or nothing.
        score: How well it is suited; a measured value beats a commanded one.
        unit: What the name says of its unit, or None.
    """

    column: str
    quantity: str
    joint: str
    score: float
    unit: str | None


def words_of(name: str) -> list[str]:
    """Words and numbers of a name, in small letters: "actualQ_2" is actual, q, 2."""
    bare = re.sub(r"[\[(][^\[\]()]*[\])]\s*$", "", name) if stated_unit(name) else name
    return [word.casefold() for word in re.findall(r"[A-Z]+(?=[A-Z][a-z])|[A-Za-z][a-z]*|[A-Z]+|\d+", _acronyms(bare))]


def _acronyms(name: str) -> str:
    """Words in capitals as ordinary words, so that they are not cut into letters."""
    return re.sub(r"[A-Z]{2,}(?![a-z])", lambda match: match[0].capitalize(), name)


def time_column(names: Iterable[str]) -> str | None:
    """The column that is most likely the time."""
    names = list(names)
    if "t" in names:
        return "t"
    scored = [(sum(word in TIME for word in words) - 0.1 * len(words), -i, name)
              for i, name in enumerate(names) if (words := words_of(name)) and set(words) & TIME]  # fmt: skip
    return max(scored)[2] if scored else None


def meaning(name: str, units: Mapping[str, str], joint_names: tuple[str, ...]) -> Meaning | None:
    """What a column's name says, or None where it speaks of no joint's motion or torque."""
    joint, rest = _joint_in(name, joint_names)
    words = words_of(rest)
    unit = units.get(name) or stated_unit(name) or _unit_word(words)
    said = set(words)
    # Contract names are beyond doubt.
    kind, _, of = name.partition(".")
    if kind in ("q", "qd", "qdd", "tau", "qdes") and of and (of in joint_names or not joint_names):
        return Meaning(name, kind, of, 10.0, unit)
    quantity = next((quantity for quantity, known in WORDS.items() if said & known and quantity != "q"), None)
    quantity = quantity or UNITS_OF.get(unit or "") or ("q" if said & WORDS["q"] or said & {"qdes", "qref"} else None)
    if quantity is None or said & FOREIGN:
        return None
    score = 1.0 + (said & MEASURED != set()) - 0.5 * (said & FILTERED != set())
    if said & COMMANDED:
        if quantity not in ("q", "tau"):
            return None
        quantity, score = ("qdes", score) if quantity == "q" else ("tau", score - 1.0)
    if quantity == "tau":
        unit = unit or ("A" if said & CURRENT and not said & TORQUE else "% of rated" if "load" in said else None)
        score -= 0.25 * (not said & TORQUE)
    return Meaning(name, quantity, joint or _joint_words(words), score, unit)


def _unit_word(words: list[str]) -> str | None:
    """A unit at the end of a name, as in `pos_1_deg`."""
    last = [word for word in words if not word.isdigit()][-1:]
    if last and last[0] in SUFFIX_UNITS and len(words) > 1:
        return "% of rated" if last[0] in ("percent", "pct") else known_unit(last[0])
    return None


def _joint_in(name: str, joint_names: tuple[str, ...]) -> tuple[str, str]:
    """The robot's joint whose words stand in a row in this name, the longest first, and the name without them."""
    for joint in sorted(joint_names, key=len, reverse=True):
        parts = [re.escape(part) for part in re.split(r"[\W_]+", joint) if part]
        pattern = r"(?<![A-Za-z0-9])" + r"[\W_]*".join(parts) + r"(?![A-Za-z0-9])"
        if parts and (found := re.search(pattern, name, re.IGNORECASE)):
            return joint, name[: found.start()] + " " + name[found.end() :]
    for joint in sorted(joint_names, key=len, reverse=True):
        core = [word for word in words_of(joint) if word not in GENERIC]
        if core and not all(word.isdigit() for word in core):
            pattern = r"(?<![A-Za-z])" + r"[\W_]*".join(map(re.escape, core)) + r"(?![A-Za-z])"
            if found := re.search(pattern, name, re.IGNORECASE):
                return joint, name[: found.start()] + " " + name[found.end() :]
    return "", name


def _joint_words(words: list[str]) -> str:
    """What is left of a name once quantity and kind are taken away: a number if there is one, else the words."""
    known = set().union(*WORDS.values()) | COMMANDED | MEASURED | FILTERED | GENERIC | SUFFIX_UNITS
    left = [word for word in words if word not in known]
    numbers = [word for word in left if word.isdigit()]
    return str(int(numbers[-1])) if numbers else "_".join(left)


def channels(
    names: Iterable[str], units: Mapping[str, str], joint_names: tuple[str, ...]
) -> dict[str, dict[str, list[Meaning]]]:
    """quantity -> joint -> its candidates, best first.

    Args:
        names: Of the file's columns.
        units: Unit by column, where the file states it.
        joint_names: Of the robot; where there is none, joints are called as the file calls them.
    """
    names = list(names)
    joint_names = joint_names or joints_of(names)
    said = [m for name in names if (m := meaning(name, units, joint_names)) is not None]
    found: dict[str, dict[str, list[Meaning]]] = defaultdict(lambda: defaultdict(list))
    for m in _numbered(said, joint_names):
        found[m.quantity][m.joint].append(m)
    for joints in found.values():
        for candidates in joints.values():
            candidates.sort(key=lambda m: -m.score)
    return {quantity: dict(joints) for quantity, joints in found.items()}


def first_number(meanings: Iterable[Meaning]) -> int:
    """The number of the first joint: 0 where it occurs, else 1."""
    return 0 if any(m.joint == "0" for m in meanings) else 1


def joints_of(names: Iterable[str]) -> tuple[str, ...]:
    """Joints by the contract's own names, `q.<joint>`, in their order in the file."""
    return tuple(name[2:].strip() for name in names if name.startswith("q.") and name[2:].strip())


def _numbered(meanings: list[Meaning], joint_names: tuple[str, ...]) -> list[Meaning]:
    """Numbers as the robot's joints in their order, and the only joint of a robot where a name tells none."""
    if not joint_names:
        called = {m.joint: f"joint{m.joint}" if m.joint.isdigit() else m.joint or "joint" for m in meanings}
        return [dataclasses.replace(m, joint=called[m.joint]) for m in meanings]
    first, result = first_number(m for m in meanings if m.quantity in ("q", "tau")), []
    for m in meanings:
        if m.joint in joint_names:
            result.append(m)
        elif m.joint.isdigit() and 0 <= int(m.joint) - first < len(joint_names):
            result.append(dataclasses.replace(m, joint=joint_names[int(m.joint) - first]))
        elif len(joint_names) == 1 and not m.joint:
            result.append(dataclasses.replace(m, joint=joint_names[0]))
    return result
