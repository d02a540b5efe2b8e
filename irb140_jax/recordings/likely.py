"""In which unit, and on which side of the gear, a channel probably is: by header, range, derivative, or model.

Positions come first: the model's torque along the motion, in radians or in degrees, tells which of the two the torque
goes with.  Then the torque's scale tells its unit.  A scale from a model is no calibration: what it hides, a wrong
mass or motor constant, a diagnosis can't find any more.
"""

import dataclasses
from collections.abc import Mapping

import numpy as np

from irb140_jax.recordings.channel_health import TOLD, Scale, swapped, torque_scales
from irb140_jax.recordings.channels import channel_doubts
from irb140_jax.recordings.check import MIN_SAMPLES
from irb140_jax.recordings.glance import Glance, glance
from irb140_jax.recordings.recording import Recording
from irb140_jax.recordings.torques import Torques, nominal_torques
from irb140_jax.recordings.units import CURRENTS, DEG, SHARES, UNITS
from irb140_jax.robot import Robot

Channels = Mapping[str, np.ndarray]  # contract name -> values in the file's unit, shape (T,)
TURNS = 2 * np.pi + 1.0  # rad; a hinge that goes beyond is probably in degrees
LARGEST_DEGREES = 720.0  # beyond two turns it is the motor that turns
SAME = 3.0  # a factor that wrong masses, friction and gains may make
CLEAR = 0.3  # of the torque's variance told by which its sign is worth a word
BETTER = 0.1  # of the torque's variance by which one unit has to beat the other
SURE = 3.0  # standard deviations that a scale has to be away from 0
SPEEDS = {"rad/s": 1.0, "deg/s": 1 / DEG, "rpm": 60 / (2 * np.pi), "rev/s": 1 / (2 * np.pi)}


@dataclasses.dataclass(frozen=True)
class Likely:
    """The likely unit of a channel.

    Attributes:
        unit: As a column map writes it; "" where nothing tells.
        side: "joint", "motor" or "".
        why: What says so, a few words.
        constants: Section of a column map -> estimated value, such as {"torque_constant": 12.3}.
        doubts: Sentences.
    """

    unit: str
    side: str
    why: str
    constants: Mapping[str, float] = dataclasses.field(default_factory=dict)
    doubts: tuple[str, ...] = ()


def likely_units(
    t: np.ndarray | None, channels: Channels, stated: Mapping[str, str | None], robot: Robot | None
) -> tuple[dict[str, Likely], list[str]]:
    """The likely unit of every channel, and doubts about several of them.

    Args:
        t: Time [s], shape (T,), or None.
        channels: Contract name -> values in the file's unit, shape (T,).
        stated: Contract name -> unit by header or name, or None.
        robot: The nominal model, or None.
    """
    joints = tuple(name[2:] for name in channels if name.startswith("q."))
    slides = {j: robot is not None and j in robot.joint_names and robot.is_slide[robot.joint_names.index(j)]
              for j in joints}  # fmt: skip
    result = {f"q.{j}": _by_range(channels[f"q.{j}"], stated[f"q.{j}"], slides[j]) for j in joints}
    doubts: list[str] = []
    look = _look(t, channels, joints, result)
    if robot is not None and look is not None and set(joints) <= set(robot.joint_names):
        result, look = _by_torque(t, channels, stated, joints, slides, result, look, robot)
    for quantity in ("qd", "qdd", "qdes"):
        for j in [name.partition(".")[2] for name in channels if name.startswith(quantity + ".")]:
            name = f"{quantity}.{j}"
            result[name] = _rate(name, stated[name], joints, look, channels, t, result.get(f"q.{j}"))
    scales = _scales(look, joints, robot) if robot is not None and look is not None else {}
    for name in (name for name in channels if name.startswith("tau.")):
        result[name] = _torque(stated[name], scales.get(name[4:]))
    if look is not None:
        doubts += _exchanged(look, joints, robot, channels, t)
    return {name: result[name] for name in channels}, doubts


def _by_range(x: np.ndarray, stated: str | None, slide: bool) -> Likely:
    if stated in UNITS:
        return Likely(str(stated), "joint", "by its header")
    largest = float(np.nanmax(np.abs(x), initial=0.0, where=np.isfinite(x)))
    if slide:
        return Likely("mm", "joint", "by its range") if largest > 10 else Likely("m", "joint", "by its range")
    if largest > LARGEST_DEGREES:
        return Likely("", "motor", "by its range", doubts=(f"reaches {largest:.4g}: the motor's side, or counts",))
    if largest > TURNS:
        return Likely("deg", "joint", "by its range")
    return Likely("rad", "joint", "by its range")


def _look(
    t: np.ndarray | None, channels: Channels, joints: tuple[str, ...], units: Mapping[str, Likely]
) -> Glance | None:
    """A glance at the motion in SI units as far as known, torque in the file's unit; None if it can't be had."""
    if t is None or not joints:
        return None
    latest = np.maximum.accumulate(np.where(np.isfinite(t), t, -np.inf))
    rising = np.isfinite(t) & np.concatenate([[True], latest[1:] > latest[:-1]])
    if rising.sum() < MIN_SAMPLES:
        return None
    filled = lambda name: _filled(channels.get(name), len(t))[rising]  # noqa: E731
    q = np.stack([filled(f"q.{j}") * UNITS.get(units[f"q.{j}"].unit, 1.0) for j in joints], axis=1)
    tau = np.stack([filled(f"tau.{j}") for j in joints], axis=1)
    return glance(Recording(t=t[rising], q=q, tau=tau, joint_names=joints))


def _filled(x: np.ndarray | None, length: int) -> np.ndarray:
    """Missing values interpolated; a channel that is not there, as zeros."""
    if x is None or not np.isfinite(x).any():
        return np.zeros(length)
    good, index = np.isfinite(x), np.arange(length)
    return np.interp(index, index[good], x[good])


def _model(look: Glance, joints: tuple[str, ...], robot: Robot) -> Torques:
    """The nominal model's torque of these joints, the others held at zero."""
    at = [robot.joint_names.index(j) for j in joints]
    motion = np.zeros((3, len(look.q), robot.n))
    motion[:, :, at] = look.q, look.qd, look.qdd
    model = nominal_torques(robot, *motion)
    return Torques(model.gravity[:, at], model.moving[:, at])


def _scales(look: Glance, joints: tuple[str, ...], robot: Robot) -> dict[str, Scale]:
    if not set(joints) <= set(robot.joint_names):
        return {}
    return dict(zip(joints, torque_scales(look, _model(look, joints, robot)), strict=True))


def _by_torque(
    t: np.ndarray | None, channels: Channels, stated: Mapping[str, str | None], joints: tuple[str, ...],
    slides: Mapping[str, bool], units: dict[str, Likely], look: Glance, robot: Robot,
) -> tuple[dict[str, Likely], Glance]:
    """Degrees or radians, for all hinges whose header says neither.

    It is the unit with which the model tells clearly more of the torque, or a little more and with which the torque, if
    it is in N m, has about the model's size: in the other one it is 57 times too large or too small.
    """
    free = [f"q.{j}" for j in joints if not slides[j] and stated[f"q.{j}"] not in UNITS and units[f"q.{j}"].unit]
    with_torque = [i for i, j in enumerate(joints) if f"tau.{j}" in channels]
    if not free or not with_torque:
        return units, look
    told, looks, sizes = {}, {}, {}
    newton_metres = [i for i in with_torque if stated[f"tau.{joints[i]}"] in (None, "N m", "N")]
    for unit in ("rad", "deg"):
        tried = dict(units) | {name: Likely(unit, "joint", "by the model's torque") for name in free}
        tried_look = _look(t, channels, joints, tried)
        if tried_look is None:
            return units, look
        looks[unit] = tried_look
        scales = torque_scales(tried_look, _model(tried_look, joints, robot))
        told[unit] = float(np.mean([scales[i].told for i in with_torque])), tried
        sizes[unit] = [abs(scales[i].value) for i in newton_metres if abs(scales[i].value) > SURE * scales[i].std]
    best, other = ("rad", "deg") if told["rad"][0] > told["deg"][0] else ("deg", "rad")
    if told[best][0] - told[other][0] >= BETTER:
        return told[best][1], looks[best]
    fits = {unit: bool(found) and 1 / SAME < float(np.median(found)) < SAME for unit, found in sizes.items()}
    return (told[best][1], looks[best]) if fits[best] and not fits[other] else (units, look)


def _rate(
    name: str, stated: str | None, joints: tuple[str, ...], look: Glance | None, channels: Channels,
    t: np.ndarray | None, position: Likely | None,
) -> Likely:
    """A speed by comparison with the derivative of the position; others by their header or as the position."""
    quantity, _, joint = name.partition(".")
    if quantity != "qd" or look is None or joint not in joints or t is None:
        like = position.unit if position is not None and quantity == "qdes" else ""
        return Likely(stated or like, "joint", "by its header" if stated else "as the position")
    derived = look.qd[:, joints.index(joint)]
    logged = _look(t, {f"q.{joint}": channels[name]}, (joint,), {f"q.{joint}": Likely("rad", "joint", "")})
    if logged is None or np.std(derived) == 0 or np.std(logged.q) == 0:
        return Likely(stated or "", "joint", "by its header" if stated else "")
    correlation = float(np.corrcoef(derived, logged.q[:, 0])[0, 1])
    ratio = float(np.std(logged.q) / np.std(derived))
    doubts = ("reversed: it falls where the position rises",) if correlation < -0.9 else ()
    if abs(correlation) < 0.9:
        return Likely(stated or "", "", "", doubts=("does not follow the derivative of the position",))
    unit = min(SPEEDS, key=lambda u: abs(np.log(ratio / SPEEDS[u])))
    if abs(np.log(ratio / SPEEDS[unit])) < 0.2:
        return Likely(unit, "joint", "by the derivative of the position", doubts=doubts)
    doubts += (f"is {ratio:.3g} times the derivative of the position",)
    return Likely(stated or "", "motor", "by the derivative of the position", doubts=doubts)


def _torque(stated: str | None, scale: Scale | None) -> Likely:
    """The unit of a torque by its header or name, and what the model says of its size."""
    if scale is None or scale.told < TOLD or abs(scale.value) < SURE * scale.std:
        why = "by its header or name" if stated else "assumed"
        why += "" if scale is None else f"; the model tells {max(scale.told, 0):.0%} of it"
        return Likely(stated or "N m", "", why)
    size, part = abs(scale.value), f"the model tells {scale.told:.0%} of it"
    doubts = ("reversed? it falls where the model's torque rises",) if scale.value < 0 and scale.told > CLEAR else ()
    if stated in CURRENTS:
        constant = 1.0 / (scale.value * CURRENTS[str(stated)])
        return Likely(str(stated), "motor", f"1 A makes about {abs(constant):.3g} N m at the joint; {part}",
                      {"torque_constant": constant}, doubts)  # fmt: skip
    if stated in SHARES:
        rated = 1.0 / (scale.value * SHARES[str(stated)])
        return Likely(str(stated), "", f"100 % is about {abs(rated):.3g} N m at the joint; {part}",
                      {"rated_torque": rated}, doubts)  # fmt: skip
    known = {u: 1.0 / UNITS[u] for u in ((stated,) if stated in UNITS else ("N m", "mN m", "kN m"))}
    unit = min(known, key=lambda u: abs(np.log(size / known[u])))
    if abs(np.log(size / known[unit])) < np.log(SAME):
        return Likely(unit, "joint", f"{size / known[unit]:.2g} times the model's; {part}", {}, doubts)
    if size * UNITS.get(str(stated or "N m"), 1.0) < 1.0:
        ratio = 1.0 / (scale.value * UNITS.get(str(stated or "N m"), 1.0))
        why = f"{size:.2g} times the model's, as behind a gear of {abs(ratio):.3g}; {part}"
        return Likely(str(stated or "N m"), "motor", why, {"gear_ratio": ratio}, doubts)
    why = f"1 N m at the joint reads {size:.3g}; {part}"
    return Likely("", "", why, {"scale": 1.0 / scale.value}, (*doubts, "no N m: a current, a share, or counts?"))


def _exchanged(
    look: Glance, joints: tuple[str, ...], robot: Robot | None, channels: Channels, t: np.ndarray | None
) -> list[str]:
    """Channels that belong to other joints than their names say."""
    says = []
    if len(joints) > 1 and all(f"qd.{j}" in channels for j in joints):
        speeds = _look(t, {f"q.{j}": channels[f"qd.{j}"] for j in joints}, joints,
                       {f"q.{j}": Likely("rad", "", "") for j in joints})  # fmt: skip
        pairs = swapped(look.qd, speeds.q) if speeds is not None else []
        says += [f"Exchanged? qd.{joints[k]} follows q.{joints[j]}" for j, k in pairs]
    if robot is not None and joints == robot.joint_names and all(f"tau.{j}" in channels for j in joints):
        # The same hypotheses by which reading refuses; sizes are judged above, in the file's unit.
        alive = (np.std(look.tau, axis=0) > 0) & (look.travel > 0)
        named = Recording(t=np.arange(float(len(look.q))), q=look.q, tau=look.tau, joint_names=joints)
        found = channel_doubts(named, look, robot, alive, alive)
        says += [f"{doubt.said[0].upper()}{doubt.said[1:]}" for doubt in found if doubt.kind != "unit"]
    return says
