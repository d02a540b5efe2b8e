"""Motion of an arm under control."""

from irb140_jax.sharding import sweep as sweep
from irb140_jax.simulate.disturbance import AbstractDisturbance as AbstractDisturbance
from irb140_jax.simulate.disturbance import SinusoidalTorque as SinusoidalTorque
from irb140_jax.simulate.disturbance import no_disturbance as no_disturbance
from irb140_jax.simulate.integrators import AbstractIntegrator as AbstractIntegrator
from irb140_jax.simulate.integrators import RungeKutta4 as RungeKutta4
from irb140_jax.simulate.integrators import SemiImplicitEuler as SemiImplicitEuler
from irb140_jax.simulate.measures import Response as Response
from irb140_jax.simulate.measures import energies as energies
from irb140_jax.simulate.measures import response as response
from irb140_jax.simulate.measures import roughness as roughness
from irb140_jax.simulate.measures import tracking_error as tracking_error
from irb140_jax.simulate.plant import AbstractPlant as AbstractPlant
from irb140_jax.simulate.plant import play as play
from irb140_jax.simulate.rollout import rollout as rollout
