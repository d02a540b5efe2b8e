"""The robot: a pytree, and the reader that makes one from MJCF or URDF."""

from irb140_jax.robot.mjcf import load_robot as load_robot
from irb140_jax.robot.mjcf import movable_joints as movable_joints
from irb140_jax.robot.mjcf import robot_from_model as robot_from_model
from irb140_jax.robot.mjcf import servos_of as servos_of
from irb140_jax.robot.robot import Robot as Robot
from irb140_jax.robot.robot import about_origin as about_origin
from irb140_jax.robot.robot import with_phi as with_phi
from irb140_jax.robot.shipped import irb140 as irb140
from irb140_jax.robot.shipped import irb140_path as irb140_path
from irb140_jax.robot.subchain import first_joints as first_joints
from irb140_jax.robot.subchain import subset as subset
from irb140_jax.robot.write import robot_mjcf as robot_mjcf
