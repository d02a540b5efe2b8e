"""Numbers and names as a person reads them."""

import math
from collections.abc import Sequence

VERDICTS = {
    "no_mismatch": "No mismatch",
    "parameters_only": "Wrong parameters only",
    "physics_left_out": "Physics left out",
    "undecided": "Undecided",
    "unexplained": "Unexplained",
}

# Half-width of a 90 % interval of a normal distribution, in standard deviations.
HALF_WIDTH_90 = 1.6449


def words(slug: str) -> str:
    """The slug of an effect or parameter as words."""
    return slug.replace("_", " ")


def joint_list(joints: Sequence[str], of: Sequence[str] = ()) -> str:
    """Names of joints, "all joints" where they are all there are (and more than two)."""
    if len(joints) > 2 and set(joints) == set(of):
        return "all joints"
    return ", ".join(joints)


def number(x: float | None, digits: int = 3) -> str:
    """x to this many significant digits, without needless zeros of an exponent; a dash where there is none."""
    if x is None or not math.isfinite(x):
        return "–"
    if x == 0:
        return "0"
    if not 1e-4 <= abs(x) < 1e6:
        return f"{x:.{digits - 1}e}".replace("-", "−")
    decimals = digits - 1 - math.floor(math.log10(abs(x)))
    return f"{round(x, decimals):.{max(decimals, 0)}f}".replace("-", "−")


def rounded_like(x: float | None, std: float | None) -> str:
    """x to the decimals that a standard deviation makes worth reading (two digits of it)."""
    if x is None:
        return "–"
    if std is None or not math.isfinite(std) or std <= 0 or not math.isfinite(x):
        return number(x, 4)
    decimals = 1 - math.floor(math.log10(std))
    if not -3 <= decimals <= 6:
        return number(x, 4)
    return f"{round(x, decimals):.{max(decimals, 0)}f}".replace("-", "−")


def with_std(value: float | None, std: float | None) -> str:
    """value ± std, both to the digits worth reading."""
    return rounded_like(value, std) + ("" if std is None else f" ± {rounded_like(std, std)}")


def interval_90(value: float | None, std: float | None) -> str:
    """90 % interval of a normal distribution."""
    if value is None or std is None:
        return "–"
    half = HALF_WIDTH_90 * std
    return f"{rounded_like(value - half, std)} to {rounded_like(value + half, std)}"


def percent(share: float | None) -> str:
    """A share in per cent: no decimals above ten, and never a certainty: what a float holds as one is rounded, too."""
    if share is None or not math.isfinite(share):
        return "–"
    if share >= 0.9995:
        return "> 99.9 %"
    if 0.0 < share < 0.0005:
        return "< 0.1 %"
    decimals = 0 if 0.1 <= abs(share) < 0.99 or share == 0.0 else 1
    return f"{100 * share:.{decimals}f} %".replace("-", "−")


def ratio(part: float | None, whole: float | None) -> str:
    """part as a share of whole, in whole per cent."""
    return "–" if part is None or not whole else f"{100 * part / whole:.0f} %"


def evidence(x: float | None) -> str:
    """A difference of BIC: one decimal where it decides, thousands set apart where it doesn't."""
    if x is None or not math.isfinite(x):
        return "–"
    shown = f"{x:.1f}" if abs(x) < 100 else f"{x:,.0f}".replace(",", "\u202f")
    return shown.replace("-", "−")


def motion_unit(torque_unit: str) -> str:
    """Unit of the position that goes with a torque: rad for a hinge, m for a slide."""
    return "m" if torque_unit == "N" else "rad"
