"""The study's identification: unknowns, objectives, baselines, and how all are judged."""

from irb140_jax.identify.baselines import Descent as Descent
from irb140_jax.identify.baselines import descents as descents
from irb140_jax.identify.baselines import nearest_least_squares as nearest_least_squares
from irb140_jax.identify.baselines import newton_step as newton_step
from irb140_jax.identify.consistency import Consistency as Consistency
from irb140_jax.identify.consistency import consistency as consistency
from irb140_jax.identify.consistency import consistent_parameters as consistent_parameters
from irb140_jax.identify.consistency import log_cholesky as log_cholesky
from irb140_jax.identify.distance import ParameterDistance as ParameterDistance
from irb140_jax.identify.distance import Penalty as Penalty
from irb140_jax.identify.distance import Units as Units
from irb140_jax.identify.distance import box as box
from irb140_jax.identify.distance import parameter_distance as parameter_distance
from irb140_jax.identify.judge import Comparison as Comparison
from irb140_jax.identify.judge import compared as compared
from irb140_jax.identify.judge import mape as mape
from irb140_jax.identify.judge import plateau as plateau
from irb140_jax.identify.judge import sought as sought
from irb140_jax.identify.linear_fit import LinearFit as LinearFit
from irb140_jax.identify.linear_fit import linear_fit as linear_fit
from irb140_jax.identify.parameters import link_parameters as link_parameters
from irb140_jax.identify.parameters import phi_of as phi_of
from irb140_jax.identify.parameters import with_link_parameters as with_link_parameters
from irb140_jax.identify.unknowns import Unknowns as Unknowns
from irb140_jax.identify.unknowns import parameter_names as parameter_names
from irb140_jax.identify.unknowns import unknowns as unknowns
