"""Where the links are and how fast they move: forward kinematics, Jacobians, singularity."""

from irb140_jax.kinematics.dh import IRB140_DH as IRB140_DH
from irb140_jax.kinematics.dh import DHTable as DHTable
from irb140_jax.kinematics.dh import dh_forward as dh_forward
from irb140_jax.kinematics.dh import dh_transform as dh_transform
from irb140_jax.kinematics.dh import irb140_end_point as irb140_end_point
from irb140_jax.kinematics.forward import axis_rotation as axis_rotation
from irb140_jax.kinematics.forward import forward_kinematics as forward_kinematics
from irb140_jax.kinematics.forward import link_frames as link_frames
from irb140_jax.kinematics.forward import link_poses as link_poses
from irb140_jax.kinematics.forward import pose as pose
from irb140_jax.kinematics.inverse import Solution as Solution
from irb140_jax.kinematics.inverse import Solutions as Solutions
from irb140_jax.kinematics.inverse import damped_least_squares as damped_least_squares
from irb140_jax.kinematics.inverse import nearest_solution as nearest_solution
from irb140_jax.kinematics.inverse import pose_error as pose_error
from irb140_jax.kinematics.inverse import rotation_vector as rotation_vector
from irb140_jax.kinematics.inverse import wrist_solutions as wrist_solutions
from irb140_jax.kinematics.jacobian import LinkJacobians as LinkJacobians
from irb140_jax.kinematics.jacobian import cross as cross
from irb140_jax.kinematics.jacobian import jacobian as jacobian
from irb140_jax.kinematics.jacobian import joint_velocities as joint_velocities
from irb140_jax.kinematics.jacobian import link_jacobians as link_jacobians
from irb140_jax.kinematics.singularity import SingularityMap as SingularityMap
from irb140_jax.kinematics.singularity import condition_number as condition_number
from irb140_jax.kinematics.singularity import singular_values as singular_values
from irb140_jax.kinematics.singularity import singularity_map as singularity_map
