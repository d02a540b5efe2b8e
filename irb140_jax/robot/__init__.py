"""The robot: a pytree, and the reader that makes one from MJCF or URDF."""

from irb140_jax.robot.mjcf import load_robot as load_robot
from irb140_jax.robot.mjcf import robot_from_model as robot_from_model
from irb140_jax.robot.robot import Robot as Robot
from irb140_jax.robot.robot import with_phi as with_phi
