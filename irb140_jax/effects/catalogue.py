"""The catalogue: every final effect class found in the files of this folder."""

import importlib
import pkgutil

from irb140_jax import effects
from irb140_jax.effects.base import AbstractEffect


def _found() -> dict[str, AbstractEffect]:
    catalogue: dict[str, AbstractEffect] = {}
    for module in sorted(pkgutil.iter_modules(effects.__path__), key=lambda m: m.name):
        if module.name == "catalogue":
            continue
        for value in vars(importlib.import_module(f"{effects.__name__}.{module.name}")).values():
            is_effect = isinstance(value, type) and issubclass(value, AbstractEffect)
            is_final = is_effect and not value.__name__.startswith("Abstract")
            if not is_final or value.__module__ != f"{effects.__name__}.{module.name}":
                continue
            if value.slug in catalogue:
                raise TypeError(f"two effects share the slug {value.slug!r}: {catalogue[value.slug]} and {value}")
            catalogue[value.slug] = value()  # pyright: ignore[reportAbstractUsage]: final, see above
    return catalogue


CATALOGUE = _found()
