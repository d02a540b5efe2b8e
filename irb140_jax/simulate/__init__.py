"""Motion of an arm under control."""

from irb140_jax.simulate.disturbance import AbstractDisturbance as AbstractDisturbance
from irb140_jax.simulate.disturbance import SinusoidalTorque as SinusoidalTorque
from irb140_jax.simulate.disturbance import no_disturbance as no_disturbance
from irb140_jax.simulate.integrators import AbstractIntegrator as AbstractIntegrator
from irb140_jax.simulate.integrators import RungeKutta4 as RungeKutta4
from irb140_jax.simulate.integrators import SemiImplicitEuler as SemiImplicitEuler
from irb140_jax.simulate.rollout import rollout as rollout
