"""A layout with which PlotJuggler opens a table: measured torque, what the models say, and what is left."""

import hashlib
import pathlib
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

import numpy as np

SUFFIX = ".plotjuggler.xml"
COLOURS = ("#222222", "#d62728", "#1f77b4", "#2ca02c")  # measured, as given, refitted, corrected
_MARK = "<?xml version='1.0' encoding='UTF-8'?>\n<!-- by irb140 predict; SHA-256 of the following lines: {} -->\n"


def write_layout(table: Mapping[str, np.ndarray], csv: str, joints: Sequence[str], path: pathlib.Path) -> None:
    """Write a layout with a tab for each joint; above the torques, below the residuals.

    The elements are those that PlotJuggler 3 saves itself; it looks for the table beside the layout.

    Args:
        table: The columns, t first.
        csv: Name of the file that holds them.
        joints: Names of the joints.
        path: Of the layout.
    """
    root = ET.Element("root")
    tabs = ET.SubElement(root, "tabbed_widget", {"name": "Main Window", "parent": "main_window"})
    for joint in joints:
        mine = [name for name in table if name.endswith(f".{joint}") and name.split(".", 1)[1] == joint]
        shown = [[n for n in mine if n.startswith(start)] for start in ("tau_", "residual_")]
        container = ET.SubElement(ET.SubElement(tabs, "Tab", tab_name=joint, containers="1"), "Container")
        split = ET.SubElement(container, "DockSplitter", orientation="-", sizes="0.5;0.5", count="2")
        _plot(split, table, shown[0], COLOURS)
        _plot(split, table, shown[1], COLOURS[1:])
    ET.SubElement(tabs, "currentTabIndex", index="0")
    ET.SubElement(root, "use_relative_time_offset", enabled="1")
    files = ET.SubElement(root, "previouslyLoaded_Datafiles")
    plugin = ET.SubElement(ET.SubElement(files, "fileInfo", filename=csv, prefix=""), "plugin", ID="DataLoad CSV")
    ET.SubElement(plugin, "default", time_axis="t", delimiter="0")
    ET.indent(root)
    body = ET.tostring(root, encoding="unicode") + "\n"
    path.write_text(_MARK.format(_sum(body)) + body, encoding="utf-8")


def is_our_layout(path: pathlib.Path) -> bool:
    """Whether a file is a layout by `write_layout` in which nothing has been changed since."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False
    found = re.match(re.escape(_MARK).replace(r"\{\}", "([0-9a-f]{64})"), text)
    return bool(found) and found[1] == _sum(text[found.end() :])


def _plot(parent: ET.Element, table: Mapping[str, np.ndarray], names: Sequence[str], colours: Sequence[str]) -> None:
    area = ET.SubElement(parent, "DockArea", name="...")
    plot = ET.SubElement(area, "plot", mode="TimeSeries", style="Lines", flip_x="false", flip_y="false")
    t, values = table["t"] - table["t"][0], np.concatenate([table[name] for name in names])
    room = 0.05 * float(np.ptp(values)) + 1e-9
    edges = {"left": t[0], "right": t[-1], "bottom": values.min() - room, "top": values.max() + room}
    ET.SubElement(plot, "range", {side: f"{value:.6f}" for side, value in edges.items()})
    ET.SubElement(plot, "limitY")
    for name, colour in zip(names, colours, strict=True):
        ET.SubElement(plot, "curve", name=name, color=colour)


def _sum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
