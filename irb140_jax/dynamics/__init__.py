"""Dynamics of serial arms: torque from motion, motion from torque, and what of the inertials can be identified."""

from irb140_jax.dynamics.base_parameters import BaseParameters as BaseParameters
from irb140_jax.dynamics.base_parameters import base_parameters as base_parameters
from irb140_jax.dynamics.batch import inverse_dynamics_batch as inverse_dynamics_batch
from irb140_jax.dynamics.c_source import c_source as c_source
from irb140_jax.dynamics.coriolis import christoffel_symbols as christoffel_symbols
from irb140_jax.dynamics.coriolis import coriolis_matrix as coriolis_matrix
from irb140_jax.dynamics.energy import kinetic_energy as kinetic_energy
from irb140_jax.dynamics.energy import potential_energy as potential_energy
from irb140_jax.dynamics.energy import spring_energy as spring_energy
from irb140_jax.dynamics.equations import forward_dynamics_christoffel as forward_dynamics_christoffel
from irb140_jax.dynamics.forward import forward_dynamics as forward_dynamics
from irb140_jax.dynamics.gram import regressor_gram as regressor_gram
from irb140_jax.dynamics.gravity import gravity_torque as gravity_torque
from irb140_jax.dynamics.mass import mass_matrix as mass_matrix
from irb140_jax.dynamics.newton_euler import inverse_dynamics as inverse_dynamics
from irb140_jax.dynamics.passive import passive_torque as passive_torque
from irb140_jax.dynamics.regressor import regressor as regressor
from irb140_jax.dynamics.regressor import regressor_batch as regressor_batch
