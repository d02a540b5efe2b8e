"""The network: inputs scaled to [-1, 1], hidden layers of one width, a linear layer out."""

from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from irb140_jax.errors import InputError

Activation = Literal["sigmoid", "tanh", "gelu"]


class Hidden(NamedTuple):
    """Hidden layers.

    Attributes:
        width: Neurons of each.
        depth: How many.
    """

    width: int
    depth: int


# The text names "a single hidden layer comprising 50 neurons" and "four hidden layers with 488 neurons", which can be
# read as their sum or as the width of each.
ONE_LAYER_50 = Hidden(50, 1)
FOUR_LAYERS_488_TOTAL = Hidden(122, 4)
FOUR_LAYERS_488_EACH = Hidden(488, 4)

# Function, its slope and its value at zero.
_ACTIVATIONS = {
    "sigmoid": (jax.nn.sigmoid, 0.25, 0.5),
    "tanh": (jnp.tanh, 1.0, 0.0),
    "gelu": (jax.nn.gelu, 0.5, 0.0),
}


class KinematicMlp(eqx.Module):
    """A multilayer perceptron with its scaling.

    The weights start in single precision: products of matrices are twice as fast as in double, and round-off of 1e-7
    of the workspace is far below what such a network learns by backpropagation.

    Attributes:
        layers: The network, from and to [-1, 1].
        inputs: Smallest and largest of each input, shape (2, i); not trained.
        outputs: What -1 and 1 stand for of each output, shape (2, o); not trained.
    """

    layers: eqx.nn.MLP
    inputs: Float[Array, "2 i"]
    outputs: Float[Array, "2 o"]

    def __call__(self, x: Float[Array, " i"]) -> Float[Array, " o"]:
        """Outputs for one sample, in their own units, shape (o,)."""
        inputs, outputs = jax.lax.stop_gradient((self.inputs, self.outputs))
        y = self.layers(scaled(x, inputs).astype(self.layers.layers[0].weight.dtype))
        return outputs[0] + 0.5 * (outputs[1] - outputs[0]) * (y + 1.0)


def scaled(x: Float[Array, " i"], ends: Float[Array, "2 i"]) -> Float[Array, " i"]:
    """x between -1 at the first of the ends and 1 at the second, shape (i,)."""
    return 2.0 * (x - ends[0]) / (ends[1] - ends[0]) - 1.0


def kinematic_mlp(
    inputs: Float[Array, "2 i"], outputs: Float[Array, "2 o"], hidden: Hidden = ONE_LAYER_50,
    activation: Activation = "sigmoid", *, key: Key[Array, ""],
) -> KinematicMlp:  # fmt: skip
    """A network before training.

    Args:
        inputs: Smallest and largest of each input, shape (2, i).
        outputs: Smallest and largest of each output, shape (2, o).
        hidden: Width and number of the hidden layers.
        activation: The study's is "sigmoid".
        key: For the weights.

    Raises:
        InputError: An unknown activation, or no hidden layer.
    """
    if activation not in _ACTIVATIONS or min(hidden) < 1:
        raise InputError(
            f"network of {hidden.depth} layers of {hidden.width}, activation {activation!r}; give at least one layer "
            f"and neuron, and one of {', '.join(_ACTIVATIONS)}"
        )
    function, slope, centre = _ACTIVATIONS[activation]
    sizes = (inputs.shape[1], outputs.shape[1], *hidden)
    layers = eqx.nn.MLP(*sizes, activation=function, dtype=jnp.float32, key=key)
    return KinematicMlp(_balanced(layers, slope, centre, key), jnp.asarray(inputs), jnp.asarray(outputs))


def _balanced(layers: eqx.nn.MLP, slope: float, centre: float, key: Key[Array, ""]) -> eqx.nn.MLP:
    """Weights by which signals neither fade nor grow through the layers, and no neuron starts saturated.

    Glorot's, over the slope of the activation: without that, four layers of sigmoids pass 1/256 of a gradient.
    Biases take off the activations' mean; those of the first layer spread the neurons over the inputs.

    Source: Glorot and Bengio, AISTATS (2010), equation 12.
    """
    last = len(layers.layers) - 1
    weights, biases = [], []
    for i, (layer, k) in enumerate(zip(layers.layers, jax.random.split(key, last + 1), strict=True)):
        fan_out, fan_in = layer.weight.shape
        gain = (1.0 if i == last else 1.0 / slope) * (2.0 / (fan_in + fan_out)) ** 0.5
        weight = gain * jax.random.normal(k, layer.weight.shape, jnp.float32)
        spread = jax.random.uniform(k, (fan_out,), jnp.float32, -1.0, 1.0) / slope
        weights.append(weight)
        biases.append(-centre * weight.sum(axis=1) if i else spread)
    where = lambda net: [x.weight for x in net.layers] + [x.bias for x in net.layers]  # noqa: E731
    return eqx.tree_at(where, layers, weights + biases)
