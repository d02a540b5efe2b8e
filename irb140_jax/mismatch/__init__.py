"""Locate, name, model and prove the physics that a rigid-body model leaves out of recordings."""

from irb140_jax.mismatch.diagnose import DiagnoseConfig as DiagnoseConfig
from irb140_jax.mismatch.diagnose import Result as Result
from irb140_jax.mismatch.diagnose import diagnose as diagnose
from irb140_jax.mismatch.model import CorrectedModel as CorrectedModel
from irb140_jax.mismatch.model import predict as predict
from irb140_jax.mismatch.store import load_model as load_model
from irb140_jax.mismatch.store import save as save
