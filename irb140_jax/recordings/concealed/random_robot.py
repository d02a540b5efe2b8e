"""Robots drawn at random that someone could have built: for showing that nothing here is about one arm."""

import numpy as np

_AXES = np.eye(3)


def random_robot(seed: int, n: int, *, slides: float = 0.2) -> str:
    """A plausible serial machine: 0.1 to 0.5 m a link, masses falling from some 10 kg to some 0.5 kg.

    Args:
        seed: Draws everything.
        n: Number of joints.
        slides: Probability of a joint being a slide.

    Returns:
        MJCF text; joints are named joint1 to joint<n>, the tool is the site `tool`.
    """
    rng = np.random.default_rng([seed, n, 50])
    mass = np.geomspace(10.0, 0.5, max(n, 2))[:n] * rng.uniform(0.7, 1.4, size=n)
    length = rng.uniform(0.1, 0.5, size=n)
    lines, previous, position = [], None, np.array([0.0, 0.0, 0.2])
    for i in range(n):
        is_slide = bool(rng.random() < slides)
        # Neighbouring axes are mostly square to each other, as in real arms; never two slides along one axis.
        options = [k for k in range(3) if k != previous or (not is_slide and rng.random() < 0.3)]
        previous = int(rng.choice(options))
        along = length[i] * _direction(rng)
        lines.append(_body(i, position, previous, is_slide, mass[i], float(mass[i:].sum()), along, rng))
        position = along
    tool = f'<site name="tool" pos="{_text(position)}" size="0.01"/>'
    motors = "".join(f'<motor name="motor{i + 1}" joint="joint{i + 1}"/>' for i in range(n))
    return (
        f'<mujoco model="random {seed}"><compiler angle="radian" autolimits="true"/>'
        '<default><geom contype="0" conaffinity="0" mass="0"/></default>'
        f"<worldbody>{''.join(lines)}{tool}{'</body>' * n}</worldbody><actuator>{motors}</actuator></mujoco>"
    )


def _body(
    i: int, position: np.ndarray, axis: int, is_slide: bool, mass: float, carried: float, along: np.ndarray,
    rng: np.random.Generator,
) -> str:
    """One link, not yet closed: a rod along the link, its mass a little off the middle, its axes turned at random."""
    radius, length = rng.uniform(0.04, 0.09), float(np.linalg.norm(along))
    # From second moments, so that some density has them.
    moments = mass * np.array([0.25 * radius**2, 0.25 * radius**2 * rng.uniform(0.5, 1.0), length**2 / 12.0])
    inertia = moments.sum() - moments
    com = along * rng.uniform(0.3, 0.6) + rng.normal(scale=0.02, size=3)
    turn = rng.normal(size=4)
    if is_slide:
        half, armature, kind = rng.uniform(0.15, 0.4), carried * rng.uniform(0.1, 0.4), "slide"
    else:
        half, armature, kind = rng.uniform(1.2, 2.8), carried * length**2 * rng.uniform(0.05, 0.5), "hinge"
    middle = 0.3 * half * rng.uniform(-1.0, 1.0)
    return (
        f'<body name="link{i + 1}" pos="{_text(position)}">'
        f'<inertial pos="{_text(com)}" quat="{_text(turn)}" mass="{mass:.6g}" diaginertia="{_text(inertia)}"/>'
        f'<joint name="joint{i + 1}" type="{kind}" axis="{_text(_AXES[axis])}" armature="{armature:.6g}" '
        f'range="{middle - half:.6g} {middle + half:.6g}"/>'
        f'<geom type="capsule" fromto="0 0 0 {_text(along)}" size="{0.5 * radius:.6g}"/>'
    )


def _direction(rng: np.random.Generator) -> np.ndarray:
    """Unit vector near one of the coordinate axes."""
    vector = _AXES[rng.integers(3)] * rng.choice([-1.0, 1.0]) + rng.normal(scale=0.15, size=3)
    return vector / np.linalg.norm(vector)


def _text(vector: np.ndarray) -> str:
    return " ".join(f"{x:.6g}" for x in vector)
