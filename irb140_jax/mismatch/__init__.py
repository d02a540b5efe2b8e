"""Locate, name, model and prove the physics that a rigid-body model leaves out of recordings."""

from irb140_jax.mismatch.corrected import CorrectedRobot as CorrectedRobot
from irb140_jax.mismatch.corrected import corrected_robot as corrected_robot
from irb140_jax.mismatch.design import Proposal as Proposal
from irb140_jax.mismatch.design import propose as propose
from irb140_jax.mismatch.diagnose import DiagnoseConfig as DiagnoseConfig
from irb140_jax.mismatch.diagnose import Result as Result
from irb140_jax.mismatch.diagnose import diagnose as diagnose
from irb140_jax.mismatch.model import CorrectedModel as CorrectedModel
from irb140_jax.mismatch.model import predict as predict
from irb140_jax.mismatch.model import prediction_times as prediction_times
from irb140_jax.mismatch.store import load_corrected as load_corrected
from irb140_jax.mismatch.store import load_model as load_model
from irb140_jax.mismatch.store import load_undecided as load_undecided
from irb140_jax.mismatch.store import save as save
from irb140_jax.mismatch.undecided import Undecided as Undecided
