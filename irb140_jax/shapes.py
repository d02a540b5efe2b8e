"""Wrong shapes get a sentence: which argument, what came, what is wanted."""

import functools
import inspect
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, get_args

import jax.numpy as jnp
import numpy as np

from irb140_jax.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")


def shape_checked(function: Callable[P, R]) -> Callable[P, R]:
    """A function whose first argument is a robot, its array arguments held against their annotated shapes.

    Lists and tuples are taken as arrays.  What jaxtyping writes in signatures is read, so that nothing is stated twice.
    Under `jax.jit` this costs nothing; under `jax.vmap` the shapes are those of one sample, as annotated.
    """
    parameters = list(inspect.signature(function).parameters.values())
    wanted = {p.name: dims for p in parameters if (dims := _wanted(p.annotation))}
    names = [p.name for p in parameters]
    named = getattr(function, "__name__", "function")

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        given: dict[str, Any] = dict(zip(names, args, strict=False)) | kwargs
        sizes = {"n": getattr(given.get(names[0]), "n", None)}
        for name, dims in wanted.items():
            if given.get(name) is None:
                continue
            if isinstance(given[name], list | tuple):
                given[name] = jnp.asarray(given[name], float)
            _check(named, name, dims, np.shape(given[name]), sizes)
        return function(*(given[name] for name in names[: len(args)]), **{name: given[name] for name in kwargs})  # pyright: ignore

    return checked


def _wanted(annotation: Any) -> list[str]:
    """Dimensions that an annotation, or the first of a union that has any, wants of an array."""
    kinds = (annotation, *get_args(annotation))
    return next((kind.dim_str.split() for kind in kinds if hasattr(kind, "dim_str")), [])


def _check(function: str, name: str, dims: list[str], came: tuple[int, ...], sizes: dict[str, Any]) -> None:
    """Raise an `InputError` unless `came` is a shape of these dimensions; sizes not known yet are learnt from it."""
    fits = len(came) == len(dims)
    for dim, size in zip(dims, came, strict=False):
        known = int(dim) if dim.isdecimal() else sizes.get(dim)
        fits = fits and known in (None, size)
    if fits:
        sizes |= {dim: size for dim, size in zip(dims, came, strict=True) if not dim.isdecimal()}
        return
    shape = _shown([str(sizes.get(dim) or dim) for dim in dims])
    many = len(came) == len(dims) + 1 and "T" not in dims
    hint = "; for many samples map over them with jax.vmap" if many else ""
    joints = f" for a robot of {sizes['n']} joints" if sizes["n"] and "n" in dims else ""
    raise InputError(f"{function}: {name} has shape {_shown([str(c) for c in came])}; give {shape}{joints}{hint}")


def _shown(sizes: list[str]) -> str:
    """A shape as Python writes it."""
    return f"({sizes[0]},)" if len(sizes) == 1 else f"({', '.join(sizes)})"
