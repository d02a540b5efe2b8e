"""The catalogue: the effect of every file of this folder that holds one, by slug."""

import importlib
import pkgutil
from collections.abc import Iterable

from irb140_jax import effects
from irb140_jax.effects.base import Effect
from irb140_jax.errors import InputError


def _found() -> dict[str, Effect]:
    catalogue: dict[str, Effect] = {}
    for name in sorted(module.name for module in pkgutil.iter_modules(effects.__path__) if module.name != "catalogue"):
        effect = getattr(importlib.import_module(f"{effects.__name__}.{name}"), "EFFECT", None)
        if effect is None:
            continue
        if effect.slug in catalogue:
            raise TypeError(f"two effects share the slug {effect.slug!r}: the second one is in {name}.py")
        catalogue[effect.slug] = effect
    return catalogue


CATALOGUE = _found()


def known(slug: str, others: Iterable[Effect] = ()) -> Effect:
    """The effect of this name, of some others or of the catalogue.

    Raises:
        InputError: There is none.
    """
    effects = CATALOGUE | {effect.slug: effect for effect in others}
    if slug not in effects:
        raise InputError(
            f"the catalogue has no effect {slug!r}: load in Python, with the effects that the diagnosis was given as "
            "`effects=[...]`"
        )
    return effects[slug]
