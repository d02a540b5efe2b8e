"""The robot that ships with the package."""

import pathlib

from irb140_jax.errors import RobotError
from irb140_jax.robot.mjcf import load_robot
from irb140_jax.robot.robot import Robot


def irb140_path() -> pathlib.Path:
    """The ABB IRB 140's model file: inside an installed package, or in assets/ of a checkout.

    Raises:
        RobotError: It is in neither place; the installation is damaged.
    """
    package = pathlib.Path(__file__).resolve().parents[1]
    places = (package / "assets" / "irb140.xml", package.parent / "assets" / "irb140.xml")
    for place in places:
        if place.is_file():
            return place
    raise RobotError(f"irb140.xml is neither at {places[0]} nor at {places[1]}: install the package again")


def irb140() -> Robot:
    """The ABB IRB 140: published geometry and limits, masses spread over the maker's CAD volumes (98 kg).

    Returns:
        The robot, 6 joints.
    """
    return load_robot(irb140_path())
