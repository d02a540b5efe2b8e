"""A first look at a recording, as words and a table for a terminal."""

import math

from rich.console import Console
from rich.table import Table

from irb140_jax.recordings.inspection import Channel, Inspection


def print_inspection(look: Inspection, console: Console) -> None:
    """Print what was found: the file, its time, a row a channel, doubts, and whether it can be read with the map."""
    console.print(f"[bold]{look.source}[/bold]: {look.format}, {look.rows} rows{_time(look)}", soft_wrap=True)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for head in ("channel", "column", "range", "unit", "by what"):
        table.add_column(head, overflow="fold")
    for channel in look.channels:
        table.add_row(channel.name, channel.column, f"{channel.low:.4g} .. {channel.high:.4g}", _unit(channel),
                      channel.likely.why)  # fmt: skip
    console.print(table)
    sentences = _doubts(look)
    sentences += [f"! {doubt}" for doubt in look.doubts]
    sentences += [f"Repaired or noted: {note}" for note in look.notes]
    if look.unused:
        sentences.append(f"Not used: {', '.join(look.unused[:20])}{' ...' if len(look.unused) > 20 else ''}")
    sentences.append(f"With this map the file can't be read yet: {look.refusal}" if look.refusal else
                     "With this map the file can be read.")  # fmt: skip
    for sentence in sentences:
        console.print(sentence, soft_wrap=True, markup=False)
    console.print()


def _doubts(look: Inspection) -> list[str]:
    """Doubts about channels, those of which the same is said together."""
    about: dict[str, list[str]] = {}
    for channel in look.channels:
        for doubt in channel.doubts:
            about.setdefault(doubt, []).append(channel.name)
    return [f"! {', '.join(names)}: {doubt}" for doubt, names in about.items()]


def _time(look: Inspection) -> str:
    if not math.isfinite(look.rate):
        return ""
    column = f"; time is {look.time} ({look.time_unit})" if look.time else ""
    return f", {look.rate:.4g} per second for {look.duration:.4g} s{column}"


def _unit(channel: Channel) -> str:
    unit = channel.likely.unit or "?"
    return f"{unit}, motor side" if channel.likely.side == "motor" else unit
