"""The study's singularity-avoiding network: kinematics learnt from samples, judged where the tool ends up."""

from irb140_jax.learned.condition import ConditionPenalty as ConditionPenalty
from irb140_jax.learned.condition import Form as Form
from irb140_jax.learned.condition import frobenius_condition_number as frobenius_condition_number
from irb140_jax.learned.judge import Manners as Manners
from irb140_jax.learned.judge import manners as manners
from irb140_jax.learned.judge import position_errors as position_errors
from irb140_jax.learned.mlp import FOUR_LAYERS_488_EACH as FOUR_LAYERS_488_EACH
from irb140_jax.learned.mlp import FOUR_LAYERS_488_TOTAL as FOUR_LAYERS_488_TOTAL
from irb140_jax.learned.mlp import ONE_LAYER_50 as ONE_LAYER_50
from irb140_jax.learned.mlp import Hidden as Hidden
from irb140_jax.learned.mlp import KinematicMlp as KinematicMlp
from irb140_jax.learned.mlp import kinematic_mlp as kinematic_mlp
from irb140_jax.learned.refine import Refinement as Refinement
from irb140_jax.learned.refine import begin_refinement as begin_refinement
from irb140_jax.learned.refine import refine as refine
from irb140_jax.learned.samples import Samples as Samples
from irb140_jax.learned.samples import joint_samples as joint_samples
from irb140_jax.learned.task import Direction as Direction
from irb140_jax.learned.task import Loss as Loss
from irb140_jax.learned.task import Task as Task
from irb140_jax.learned.train import Curve as Curve
from irb140_jax.learned.train import Settings as Settings
from irb140_jax.learned.train import State as State
from irb140_jax.learned.train import begin as begin
from irb140_jax.learned.train import train as train
