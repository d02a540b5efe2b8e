"""What must be reached, and the table that says whether it was; computes nothing, needs nothing."""

import math

# name: (goal, "min" or "max"); ratios are against the peer in the same run.
GOALS = {
    "inverse_dynamics_1e3_ratio": (2.5, "min"),
    "inverse_dynamics_1e5_ratio": (2.5, "min"),
    "inverse_dynamics_1e3_compile_s": (2.0, "max"),
    "inverse_dynamics_1e5_compile_s": (2.0, "max"),
    "paper_style_ratio": (10.0, "min"),
    "paper_style_compile_ours_s": (3.0, "max"),
    "identification_ratio": (6.0, "min"),
    "identification_extra_mb": (100.0, "max"),
    "rollouts_ratio": (7.0, "min"),
    "rollouts_compile_s": (3.0, "max"),
    "runge_kutta_diffrax_ratio": (5.0, "min"),
    "swarms_run_s": (1.0, "max"),
    "swarms_with_compile_s": (3.0, "max"),
    "swarm_pyswarms_ratio": (10.0, "min"),
    "swarm_evosax_ratio": (1.0, "min"),
    "swarm_evosax_with_compile_ratio": (5.0, "min"),
    "swarm_torque_over_distance": (1.5, "max"),
    "diagnose_warm_s": (15.0, "max"),
    "diagnose_gb": (2.0, "max"),
}


def missed(name: str, metrics: dict[str, float], slack: float) -> str | None:
    """Why this goal is not met; None if it is."""
    goal, sense = GOALS[name]
    value = metrics.get(name, math.nan)
    met = value >= goal * slack if sense == "min" else value <= goal / slack
    return None if met else f"{name}: {value:.3g}, goal {'at least' if sense == 'min' else 'at most'} {goal:g}"


def table(metrics: dict[str, float]) -> str:
    """All metrics, with their goals, as a Markdown table."""
    rows = ["| metric | value | goal |", "|---|---|---|"]
    for name, value in metrics.items():
        goal, sense = GOALS.get(name, (None, ""))
        wanted = "" if goal is None else f"{'>=' if sense == 'min' else '<='} {goal:g}"
        rows.append(f"| {name} | {value:.3g} | {wanted} |")
    return "\n".join(rows)


def page(results: dict) -> str:
    """README.md of this folder, out of the results alone."""
    made = ", ".join(f"{name} {value}" for name, value in results["machine"].items())
    short = "; ".join(results["failures"]) or "nothing"
    return (
        "# Benchmarks\n\n"
        "Written by `python benchmarks/run.py` (needs the extra `bench`); don't edit.\n\n"
        f"IRB 140, float64, pinned to one core; XLA's default options, and `compiler.QUICK` for `rollouts` and "
        f"`runge_kutta`, ours and the peers'; processor time, median of {results['rounds']} "
        "rounds in which ours and the peer's run in turn; compile time is that of the first call less the second's. "
        "`1e3`, `1e5`: samples a call. `per_s`: samples a second. `paper_style`: M, Christoffel C and g, against C by "
        "`jacfwd` of M. `identification`: 60 000 samples of six joints, Gram matrix and solution, against Pinocchio's "
        "regressor loop and NumPy's lstsq. `rollouts`: 90 closed loops of 30 s at 1 ms, three joints, Christoffel "
        "Coriolis, sliding mode, against `mujoco.rollout` of the same arm, no controller, limits or friction. "
        "`runge_kutta`: the same by Runge-Kutta of order 4, against diffrax's Tsit5 at the same fixed step, on the "
        "equations in arrays and on our own in scalars; `evaluation`: the closed loop once, in ours (four a step), an "
        "Euler step (one) and diffrax on our equations (six), all that a step costs included: as far as these are near "
        "each other the time is the equations', and on the same ones little but six to four is left to gain. "
        "`swarms`: the study's PSO and angle QPSO one after the other, 30 seeds x 120 particles x 150 iterations of 27 "
        "unknowns; pyswarms loops over the seeds, evosax draws two random numbers a particle where ours draws two an "
        "unknown, and keeps no history; `bare`: equations 17 to 19 alone with a cheaper hash, no history, rules or "
        "options, compiled by XLA's default and by `QUICK`: what ours could come down to. Neither has both a fifth "
        "of evosax's compile + run (`fifth_of_evosax_s`) and its run time; `trace`, `lower`, `compile` are the parts "
        "of our first call. Exporting the program ahead of time would save the first two; the third remains, unless "
        "the persistent compilation cache has it; "
        "`torque_over_distance`: the same sweep on the torque of 2000 samples. "
        "`diagnose`: the command on three recordings of 20 s at 500 Hz, six joints, as a process on all cores: wall "
        "time, the first time and from a warm compilation cache, and the most memory it holds.\n\n"
        f"{made}\n\nMissed in this run: {short}.\n\n{table(results['metrics'])}\n"
    )
