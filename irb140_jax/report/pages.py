"""The templates of all pages, each one HTML file that needs no network."""

import functools
import pathlib

import jinja2

from irb140_jax.report import text

PAGE = pathlib.Path(__file__).parent / "page"


@functools.cache
def template(name: str) -> jinja2.Template:
    """A page, with everything from outside escaped."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(PAGE),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {show.__name__: show for show in (text.words, text.joint_list, text.evidence, text.ratio)}
    numbers = (text.number, text.rounded_like, text.with_std, text.interval_90, text.percent)
    environment.filters |= {show.__name__: show for show in numbers}
    return environment.get_template(name)


def stylesheet() -> str:
    """The style of all pages."""
    return (PAGE / "report.css").read_text(encoding="utf-8")
