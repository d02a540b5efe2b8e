"""Backpropagation with an adaptive rate that starts at 0.01, and a stop when validation no longer improves."""

from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Bool, Float, Int, Key

from irb140_jax.learned.judge import position_errors
from irb140_jax.learned.mlp import KinematicMlp
from irb140_jax.learned.samples import Samples
from irb140_jax.learned.task import Task
from irb140_jax.types import Scalar


class Settings(NamedTuple):
    """How to train.

    Attributes:
        epochs: Passes over the samples, over which the rate falls to nothing (half a cosine).
        batch: Samples per step.
        rate: Rate at the start; the study's.
        warm_up: Share of the epochs over which the rate first rises to that, which the text does not name.  Deep
            networks of sigmoids whose first steps are as long as later ones often get stuck.
        optimiser: "adam", or "sgd" with momentum 0.9, both with clipped steps; or "plain" gradient descent.
        patience: Share of the epochs without improvement after which the rate is halved beyond that.  A rate of 0.01
            makes validation noisy; halved at the first pause it is spent before the network has learnt much.
        stop: Share of the epochs without improvement after which training ends.
        improvement: Share by which validation must fall to count as improved.
    """

    epochs: int = 600
    batch: int = 250
    rate: float = 0.01
    warm_up: float = 0.0
    optimiser: Literal["adam", "sgd", "plain"] = "adam"
    patience: float = 0.125
    stop: float = 0.33
    improvement: float = 1e-3


class State(eqx.Module):
    """Where training stands; saved with `eqx.tree_serialise_leaves`, it goes on as if never interrupted.

    Attributes:
        network: The network as it is.
        best: The network that did best on validation.
        best_error: Its mean position error there [m].
        moments: State of the optimiser.
        plateau: State of the rate.
        waited: Epochs since `best_error` last fell by the wanted share.
        epoch: Epochs done.
    """

    network: KinematicMlp
    best: KinematicMlp
    best_error: Scalar
    moments: Any
    plateau: Any
    waited: Int[Array, ""]
    epoch: Int[Array, ""]

    def stopped(self, settings: Settings) -> Bool[Array, ""]:
        """Whether training has ended."""
        return (self.waited >= settings.stop * settings.epochs) | (self.epoch >= settings.epochs)


class Curve(NamedTuple):
    """One entry an epoch; NaN for those after the end.

    Attributes:
        cost: Mean cost of the batches as they were met.
        training: Their mean position error [m].
        validation: Mean position error on the validation samples after the epoch [m].
        rate: Learning rate at its end.
    """

    cost: Float[Array, " e"]
    training: Float[Array, " e"]
    validation: Float[Array, " e"]
    rate: Float[Array, " e"]


def begin(network: KinematicMlp, settings: Settings) -> State:
    """The state before the first epoch."""
    moments = _optimiser(settings).init(eqx.filter(network, eqx.is_array))
    plateau = _plateau(settings).init(jnp.ones(()))
    nothing = jnp.asarray(0)
    return State(network, network, jnp.full((), jnp.inf), moments, plateau, nothing, nothing)


@eqx.filter_jit
def train(
    state: State, task: Task, training: Samples, validation: Samples, settings: Settings, epochs: int,
    *, key: Key[Array, ""],
) -> tuple[State, Curve]:  # fmt: skip
    """Some epochs of training, as one compiled scan over epochs and batches.

    Args:
        state: Where to go on from, see `begin`.
        task: What is asked, and what an answer costs.
        training: Samples to learn from; those which do not fill a batch sit out an epoch, others in each.
        validation: Samples that decide on rate, stop and which network is best.
        settings: How to train.
        epochs: How many epochs now; fewer are done where training ends.
        key: For the order of the samples; the same one each time.

    Returns:
        The state then, and the curve of these epochs.
    """
    inputs, static = task.inputs(training), eqx.filter(state.network, eqx.is_array, inverse=True)

    def cost(arrays, rows: Int[Array, " b"]) -> tuple[Scalar, Scalar]:
        return task.cost(eqx.combine(arrays, static), inputs[rows], training.position[rows])

    def step(carry, now: tuple[Int[Array, " b"], Scalar]):
        (arrays, moments), (rows, rate) = carry, now
        value, slope = jax.value_and_grad(cost, has_aux=True)(arrays, rows)
        change, moments = _optimiser(settings).update(slope, moments)
        arrays = jax.tree.map(lambda a, c: a - (rate * c).astype(a.dtype), arrays, change)
        return (arrays, moments), value

    def epoch(state: State) -> tuple[State, Curve]:
        falling = 0.5 * (1.0 + jnp.cos(jnp.pi * state.epoch / settings.epochs))
        rows = _batches(jax.random.fold_in(key, state.epoch), len(inputs), settings.batch)
        rates = settings.rate * falling * state.plateau.scale * _warm(state.epoch, len(rows), settings)
        start = eqx.filter(state.network, eqx.is_array), state.moments
        (arrays, moments), met = jax.lax.scan(step, start, (rows, rates))
        error = jnp.mean(position_errors(task, eqx.combine(arrays, static), validation))
        after = _remembered(state, eqx.combine(arrays, static), error, settings)
        curve = Curve(jnp.mean(met[0]), jnp.mean(met[1]), error, rates[-1])
        return eqx.tree_at(lambda s: s.moments, after, moments), curve

    def one(arrays, _):
        state = eqx.combine(arrays, rest)
        idle = Curve(*[jnp.full((), jnp.nan)] * len(Curve._fields))
        ahead = lambda: jax.tree.map(jnp.asarray, _arrays(epoch(state)))  # noqa: E731
        return jax.lax.cond(state.stopped(settings), lambda: (arrays, idle), ahead)

    arrays, rest = eqx.partition(state, eqx.is_array)
    arrays, curve = jax.lax.scan(one, arrays, None, epochs)
    return eqx.combine(arrays, rest), curve


def _warm(epoch: Int[Array, ""], steps: int, settings: Settings) -> Float[Array, " steps"]:
    """What share of the rate every step of an epoch has."""
    done = epoch + jnp.arange(1, steps + 1) / steps
    rise = settings.warm_up * settings.epochs
    return jnp.minimum(1.0, done / rise) if rise else jnp.ones(steps)


def _arrays(tree):
    return eqx.filter(tree, eqx.is_array)


def _remembered(state: State, network: KinematicMlp, error: Scalar, settings: Settings) -> State:
    """Keep the best network, count what was waited, and adapt the rate; an error that is NaN is never best."""
    better = error < state.best_error
    improved = error < (1.0 - settings.improvement) * state.best_error
    keep = lambda new, old: jnp.where(better, new, old) if eqx.is_array(new) else new  # noqa: E731
    _, plateau = _plateau(settings).update(jnp.ones(()), state.plateau, value=error)
    best = jax.tree.map(keep, network, state.best)
    waited = jnp.where(improved, 0, state.waited + 1)
    return State(network, best, keep(error, state.best_error), state.moments, plateau, waited, state.epoch + 1)


def _batches(key: Key[Array, ""], count: int, batch: int) -> Int[Array, "steps b"]:
    batch = min(batch, count)
    steps = count // batch
    return jax.random.permutation(key, count)[: steps * batch].reshape(steps, batch)


def _optimiser(settings: Settings) -> optax.GradientTransformation:
    """Directions of unit rate; the rate itself changes with the epochs."""
    if settings.optimiser == "plain":
        return optax.identity()
    adam, momentum = optax.scale_by_adam(), optax.trace(decay=0.9)
    # Near a singular pose a single batch may have a slope that undoes all before it.
    return optax.chain(optax.clip_by_global_norm(1.0), adam if settings.optimiser == "adam" else momentum)


def _plateau(settings: Settings) -> Any:
    patience = max(1, round(settings.patience * settings.epochs))
    return optax.contrib.reduce_on_plateau(factor=0.5, patience=patience, rtol=settings.improvement)
