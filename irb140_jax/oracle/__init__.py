"""A second opinion on kinematics and dynamics from MuJoCo (C) and MJX, sharing no code with ours.

Import `irb140_jax.oracle.mujoco` or `irb140_jax.oracle.mjx`: the same functions in both.  MJX is slow to import and
takes 10 s and more to compile, so neither is imported from here.
"""
