"""What a diagnosis leaves on disk, put together by hand in no time: a model with friction, and open questions."""

import json
import pathlib

import helpers_recordings
import numpy as np

from irb140_jax.effects import Scales
from irb140_jax.effects.catalogue import CATALOGUE
from irb140_jax.mismatch.columns.torques import Named
from irb140_jax.mismatch.corrected.model import CorrectedModel, to_json
from irb140_jax.mismatch.experiment_design.undecided import Column, Pair, Undecided, save_undecided
from irb140_jax.recordings.low_pass import Band

BAND = Band(torque=8.0, position=12.0, rate=100.0, step=2)


def model() -> CorrectedModel:
    """Of the three-joint arm of `helpers_recordings`: a heavier last link, and Coulomb friction on the elbow."""
    robot = helpers_recordings.robot()
    phi = np.asarray(robot.phi)
    friction = Named(CATALOGUE["coulomb_friction"], (1,), (0,), np.array([0.7]), np.zeros(0))
    heavier = phi * np.array([1.0, 1.0, 1.1])[:, None]
    return CorrectedModel(robot, 1.02 * phi, heavier, (friction,), BAND, np.full(3, 1e-3))


def open_questions() -> Undecided:
    """Friction of the elbow may be dry or viscous, and the rotor of the wrist could not be seen."""
    at = {"coulomb_friction": 1, "viscous_friction": 1, "rotor_inertia": 2}
    columns = tuple(Column(CATALOGUE[slug], (joint,), (), (0,)) for slug, joint in at.items())
    gram = np.eye(34)
    gram[:-1, -1] = gram[-1, :-1] = 0.1
    gram[30, 31] = gram[31, 30] = 0.9
    pair = Pair((1,), "coulomb_friction", "viscous_friction", 0.4, (), ((0,),), ((1,),))
    ones = np.ones(3)
    scales = Scales(ones, 1e-3 * ones, 5.0 * ones, -ones, ones, 20.0, 0.1 * ones, 1e-5 * ones)
    return Undecided(
        columns, (0,), (), (pair,), (2,), gram, ones, ones, 0.05, np.tile([1.0, 0.0], (3, 1)), 0.05 * ones, BAND, scales
    )


def stored(folder: pathlib.Path) -> pathlib.Path:
    """The folder, with `model.json` and `undecided.npz` of these."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.json").write_text(json.dumps(to_json(model())))
    save_undecided(open_questions(), folder)
    return folder
