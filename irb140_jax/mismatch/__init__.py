"""Locate, name, model and prove the physics that a rigid-body model leaves out of recordings."""

from irb140_jax.mismatch.corrected.model import CorrectedModel as CorrectedModel
from irb140_jax.mismatch.corrected.model import predict as predict
from irb140_jax.mismatch.corrected.model import prediction_times as prediction_times
from irb140_jax.mismatch.corrected.robot import CorrectedRobot as CorrectedRobot
from irb140_jax.mismatch.corrected.robot import corrected_robot as corrected_robot
from irb140_jax.mismatch.diagnose import DiagnoseConfig as DiagnoseConfig
from irb140_jax.mismatch.diagnose import diagnose as diagnose
from irb140_jax.mismatch.experiment_design.design import Proposal as Proposal
from irb140_jax.mismatch.experiment_design.design import propose as propose
from irb140_jax.mismatch.experiment_design.undecided import Undecided as Undecided
from irb140_jax.mismatch.output.own_simulation import CorrectedMujoco as CorrectedMujoco
from irb140_jax.mismatch.output.store import Result as Result
from irb140_jax.mismatch.output.store import load_corrected as load_corrected
from irb140_jax.mismatch.output.store import load_diagnosis as load_diagnosis
from irb140_jax.mismatch.output.store import load_model as load_model
from irb140_jax.mismatch.output.store import load_undecided as load_undecided
from irb140_jax.mismatch.output.store import save as save
from irb140_jax.mismatch.result import Diagnosis as Diagnosis
from irb140_jax.mismatch.result import Finding as Finding
