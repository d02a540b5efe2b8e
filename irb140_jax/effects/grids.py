"""Grids of shape parameters: the sizes they are made for, and how they are laid out."""

from typing import NamedTuple

import numpy as np

NOISES = 10.0  # of the encoder in the least gap or dead band that is looked for: a few explain its noise in the torque


class Scales(NamedTuple):
    """Sizes of a set of recordings, for grids of shape parameters; each of shape (n,)."""

    speed: np.ndarray  # largest speed of each joint [rad/s or m/s]
    rest_speed: np.ndarray  # speed the encoders can't tell from rest
    torque: np.ndarray  # RMS of the logged torque [N m or N]
    low: np.ndarray  # lowest and highest position [rad or m]
    high: np.ndarray
    duration: float  # of the longest recording [s]
    inertia: np.ndarray  # mean inertia of the links about each joint, without rotors [kg m^2 or kg]
    q_noise: np.ndarray  # standard deviation of the encoders' white noise [rad or m]


def between_neighbours(grid: np.ndarray, best: np.ndarray, *, beyond: int = 0, reach: int = 1) -> np.ndarray:
    """As many grid points of one parameter, in equal ratios, between neighbours of the best, shape (points, 1).

    Args:
        grid: As it was, shape (points, 1).
        best: Its best point, shape (1,).
        beyond: How many neighbours an end of the grid has outside of it.
        reach: Which neighbours: the next ones, or the ones after those.
    """
    values = np.sort(grid[:, 0])
    for _ in range(beyond):
        values = np.array([values[0] ** 2 / values[1], *values, values[-1] ** 2 / values[-2]])
    at = int(np.argmin(np.abs(values - best[0])))
    return np.geomspace(values[max(at - reach, 0)], values[min(at + reach, len(values) - 1)], len(grid))[:, None]


def top_of_parabola(low: float, middle: float, high: float) -> float:
    """Where the parabola through values at -1, 0 and 1 is highest, between -1 and 1; 0 where it is flat."""
    bend = 2.0 * middle - low - high
    return float(np.clip(0.5 * (high - low) / bend, -1.0, 1.0)) if bend > 0.0 else 0.0


def nearest_in_each_direction(grid: np.ndarray, best: np.ndarray) -> list[np.ndarray]:
    """Points beside one of a grid, the nearest first, for each direction in which the grid has any.

    Args:
        grid: Shape (points, shape parameters).
        best: The point, shape (shape parameters,).

    Returns:
        Indices of the points on either side, of each direction that is not made up of those before.
    """
    offsets = (grid - best) / np.maximum(np.ptp(grid, axis=0), 1e-300)
    length = np.linalg.norm(offsets, axis=1)
    order, out, beyond = np.argsort(length, kind="stable"), [], np.eye(len(best))
    for i in order[length[order] > 0.0]:
        rest = beyond @ offsets[i]
        if np.linalg.norm(rest) > 0.5 * length[i]:
            along = np.abs(offsets[order] @ offsets[i]) > 0.999 * length[order] * length[i]
            out.append(order[along & (length[order] > 0.0)])
            beyond = beyond - np.outer(rest, rest) / (rest @ rest)
    return out


def geometric_grid(low: float, high: float, points: int) -> np.ndarray:
    """Grid of one shape parameter, equal ratios from low to high, shape (points, 1)."""
    return np.geomspace(low, max(high, low * 1.001), points)[:, None]
