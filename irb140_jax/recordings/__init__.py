"""Recordings: reading, checking, conditioning, excitation, and recordings with concealed physics."""

from irb140_jax.recordings.drive import Drive as Drive
from irb140_jax.recordings.drive import drive_of_model as drive_of_model
from irb140_jax.recordings.drive import stated_drive as stated_drive
from irb140_jax.recordings.inspection import Inspection as Inspection
from irb140_jax.recordings.inspection import inspect_recording as inspect_recording
from irb140_jax.recordings.joints import common_joints as common_joints
from irb140_jax.recordings.payload import Payload as Payload
from irb140_jax.recordings.read import read_recording as read_recording
from irb140_jax.recordings.read import recorded_joints as recorded_joints
from irb140_jax.recordings.recording import Recording as Recording
from irb140_jax.recordings.recording import recording_columns as recording_columns
from irb140_jax.recordings.recording import rows_of as rows_of
from irb140_jax.recordings.recording import write_recording as write_recording
