"""Proof in motion: simulated from recorded torque, does the corrected model move as the robot did?"""

from irb140_jax.mismatch.motion.proof import proof_in_motion as proof_in_motion
from irb140_jax.mismatch.motion.unseen import motion_unseen as motion_unseen
