"""Swarms for any box-bounded minimisation; they know nothing of robots."""

from irb140_jax.swarm.adaptive_attractor import AdaptiveAttractorQpso as AdaptiveAttractorQpso
from irb140_jax.swarm.base import Clock as Clock
from irb140_jax.swarm.base import History as History
from irb140_jax.swarm.base import Rule as Rule
from irb140_jax.swarm.base import Swarm as Swarm
from irb140_jax.swarm.constricted import ConstrictedPso as ConstrictedPso
from irb140_jax.swarm.decode import Amplitude as Amplitude
from irb140_jax.swarm.decode import Bits as Bits
from irb140_jax.swarm.decode import Decode as Decode
from irb140_jax.swarm.delta_well import DeltaWellQpso as DeltaWellQpso
from irb140_jax.swarm.draws import Draws as Draws
from irb140_jax.swarm.draws import seed_keys as seed_keys
from irb140_jax.swarm.minimise import Minima as Minima
from irb140_jax.swarm.minimise import Objective as Objective
from irb140_jax.swarm.minimise import Steady as Steady
from irb140_jax.swarm.minimise import minimise as minimise
from irb140_jax.swarm.noise_resilient import NoiseResilientQpso as NoiseResilientQpso
from irb140_jax.swarm.pso import Pso as Pso
from irb140_jax.swarm.qubit_pso import QubitPso as QubitPso
from irb140_jax.swarm.schedule import Schedule as Schedule
from irb140_jax.swarm.schedule import constant as constant
from irb140_jax.swarm.schedule import damped as damped
from irb140_jax.swarm.schedule import linear as linear
from irb140_jax.swarm.self_tuning import SelfTuningQpso as SelfTuningQpso
from irb140_jax.swarm.two_attractors import TwoAttractorsQpso as TwoAttractorsQpso
