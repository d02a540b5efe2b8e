"""In motion: numbers of servos that follow it, and whether the corrected model moves as the robot did."""

from irb140_jax.mismatch.motion.fit import MotionFit as MotionFit
from irb140_jax.mismatch.motion.proof import proof_in_motion as proof_in_motion
from irb140_jax.mismatch.motion.unseen import fitted_in_motion as fitted_in_motion
from irb140_jax.mismatch.motion.unseen import motion_unseen as motion_unseen
