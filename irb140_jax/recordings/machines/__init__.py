"""Readers of real machines' published recordings: pure functions, no data."""

from irb140_jax.recordings.machines.bam_xl330 import servo_commands as servo_commands
from irb140_jax.recordings.machines.bam_xl330 import servo_model as servo_model
from irb140_jax.recordings.machines.bam_xl330 import servo_recording as servo_recording
from irb140_jax.recordings.machines.bam_xl330 import servo_runs as servo_runs
from irb140_jax.recordings.machines.bam_xl330 import write_servo as write_servo
from irb140_jax.recordings.machines.cycloidal_play import cycloidal_model as cycloidal_model
from irb140_jax.recordings.machines.cycloidal_play import cycloidal_recording as cycloidal_recording
from irb140_jax.recordings.machines.cycloidal_play import cycloidal_runs as cycloidal_runs
from irb140_jax.recordings.machines.cycloidal_play import write_cycloidal as write_cycloidal
from irb140_jax.recordings.machines.dfki_double_pendulum import pendulum_model as pendulum_model
from irb140_jax.recordings.machines.dfki_double_pendulum import (
    pendulum_model_with_mistake as pendulum_model_with_mistake,
)
from irb140_jax.recordings.machines.dfki_double_pendulum import pendulum_recording as pendulum_recording
from irb140_jax.recordings.machines.dfki_double_pendulum import pendulum_runs as pendulum_runs
from irb140_jax.recordings.machines.dfki_double_pendulum import write_pendulum as write_pendulum
from irb140_jax.recordings.machines.folder import recordings_folder as recordings_folder
from irb140_jax.recordings.machines.so101 import so101_model as so101_model
from irb140_jax.recordings.machines.so101 import so101_recording as so101_recording
from irb140_jax.recordings.machines.staubli_tx40 import tx40_model as tx40_model
from irb140_jax.recordings.machines.staubli_tx40 import tx40_recording as tx40_recording
from irb140_jax.recordings.machines.staubli_tx40 import write_tx40 as write_tx40
from irb140_jax.recordings.machines.unitree_go2 import go2_model as go2_model
from irb140_jax.recordings.machines.unitree_go2 import go2_recording as go2_recording
from irb140_jax.recordings.machines.unitree_go2 import go2_split as go2_split
