"""Named cases that an engine has to survive: each is one sentence, on the IRB 140."""

import dataclasses
from collections.abc import Callable

import numpy as np

from testbed import leaving_out, rubbing
from testbed.arms import built, irb140
from testbed.cases import STATED, Case, assembled
from testbed.loggers import Logger
from testbed.motions import programme
from testbed.plants import Plant, Sizes, sizes_of
from testbed.seeds import generator

Hide = Callable[[Plant, Sizes, np.random.Generator], None]


def probe(hide: Hide | None = None, *, programmed: str = "mixed", noise: float = 0.01, error: float = 0.05,
          times: int = 1, ordinary: bool = True, name: str = "probe") -> Case:  # fmt: skip
    """The IRB 140 with ordinary friction and what `hide` adds: three recordings of 15 s at 250 Hz.

    Args:
        hide: What else differs from the model.
        programmed: See `motions.PROGRAMMES`.
        noise: Of the torque sensors, in shares of each joint's RMS.
        error: True relative error of the inertials; 5 % is stated.
        times: How often the same files are given.
        ordinary: Whether joints rub.
        name: Of the probe.
    """
    rng, nominal = generator("work", 0, name), irb140()
    motions = programme(nominal, rng, programmed, 15.0)
    plant, sizes = Plant(nominal, built(nominal, rng, error)), sizes_of(nominal, motions)
    if hide:
        hide(plant, sizes, rng)
    if ordinary:
        rubbing.rubbed(plant, sizes, rng)
    logger = Logger(250.0, 0.0, True, np.full(6, 2 * np.pi / 2**20), noise * sizes.tau, 1e-3 * noise * sizes.tau)
    unseen = [dataclasses.replace(m, number=100) for m in programme(nominal, rng, "fourier", 10.0)[:1]]
    setting = {"inertial_error": error, "stated_error": STATED, "programme": programmed, "strength": {}}
    case = assembled("work", 0, (name,), plant, sizes, motions, unseen, logger, rng, setting)
    return dataclasses.replace(case, recordings=case.recordings * times)


def _skewed(plant, sizes, rng):
    leaving_out.skew(plant, sizes, rng, 0, 0.0)
    plant.late = np.array([0.001] * 3 + [0.006] * 3)


def _by_the_day(plant, sizes, rng):
    for j in range(6):
        rubbing.by_the_day(plant, sizes, rng, j, 0.1 * sizes.tau[j], factors=(1.6, 1.0, 1.25))


def _bristles(plant, sizes, rng):
    for j in range(6):
        rubbing.bristles(plant, sizes, rng, j, 0.1 * sizes.tau[j], travel=1e-3)


def _stiff(plant, sizes, rng):
    for j in range(6):
        rubbing.stiff_dahl(plant, sizes, rng, j, 0.1 * sizes.tau[j], travel=3e-4)


def _spring(plant, sizes, rng):
    leaving_out.hardening_spring(plant, sizes, rng, 1, 0.3 * sizes.tau[1])


def _dead(plant, sizes, rng):
    for j in (2, 4):
        leaving_out.dead(plant, sizes, rng, j, 0.0)
        plant.dead[j] = lambda t, tau: np.zeros_like(tau)


PROBES: dict[str, tuple[str, Callable[[], Case]]] = {
    "plain": ("12 ordinary frictions", lambda: probe(name="plain")),
    "nothing": ("inertials 5 % wrong, nothing else", lambda: probe(name="nothing", ordinary=False)),
    "repeated": ("12 ordinary frictions, one programme played three times",
                 lambda: probe(programmed="repeated", name="repeated")),
    "five_times": ("the files of `plain`, each given five times", lambda: probe(times=5, name="plain")),
    "all_constants": ("all torques logged 15 % too large", lambda: probe(
        lambda p, s, r: leaving_out.all_constants(p, s, r, 0, 0.0), name="all_constants")),
    "two_constants": ("torques of joints 2 and 3 logged 70 % too large", lambda: probe(
        lambda p, s, r: leaving_out.two_constants(p, s, r, 1, 0.0), name="two_constants")),
    "skewed": ("torque channels 1 to 3 late by 1 ms, 4 to 6 by 6 ms", lambda: probe(_skewed, name="skewed")),
    "by_the_day": ("friction x 1.6, 1, 1.25 in the three recordings", lambda: probe(_by_the_day, name="by_the_day")),
    "lugre": ("LuGre (1 mrad) on all joints", lambda: probe(_bristles, name="lugre")),
    "lugre_quiet": ("the same at a tenth of the noise", lambda: probe(_bristles, noise=0.001, name="lugre")),
    "stiff_dahl": ("Dahl (0.3 mrad) on all joints", lambda: probe(_stiff, name="stiff_dahl")),
    "spring": ("friction and a hardening spring on joint 2", lambda: probe(_spring, name="spring")),
    "dead": ("torque channels 3 and 5 dead", lambda: probe(_dead, name="dead")),
    "wrong_inertials": ("inertials 30 % wrong, 5 % stated", lambda: probe(error=0.3, name="wrong_inertials")),
}  # fmt: skip
