"""A made-up diagnosis with everything a report may have to show.  The numbers are invented; only their form matters."""

import numpy as np

from irb140_jax.mismatch.output.inertials import LinkShift
from irb140_jax.mismatch.output.views import Maps, Ranked, Traces, UnexplainedTorque, Views
from irb140_jax.mismatch.result import Diagnosis

JOINTS = tuple(f"joint{i}" for i in range(1, 7))


def example_diagnosis() -> Diagnosis:
    """What `example_document` says."""
    return Diagnosis.from_json(example_document())


def example_document() -> dict:
    """A diagnosis.json with two findings, an alternative, something unexplained and something not testable."""
    fit = {}
    for i, name in enumerate(JOINTS):
        nominal, refit = 9.4 / (1 + i), 6.1 / (1 + i)
        fit[name] = {
            "rmse_nominal": nominal,
            "rmse_refit": refit,
            "rmse_corrected": 0.5 / (1 + i) + (0.9 if name == "joint5" else 0.0),
            "noise_floor": None if name == "joint6" else 0.42 / (1 + i),
        }
    return {
        "schema": 2,
        "verdict": "physics_left_out",
        "findings": [
            {
                "effect": "stribeck_friction",
                "joints": ["joint2"],
                "where": "On joint2 whenever it moves, strongest below 0.12 rad/s.",
                "parameters": {
                    "coulomb": {"value": 8.4312, "std": 0.0712, "unit": "N m"},
                    "static": {"value": 12.913, "std": 0.31, "unit": "N m"},
                    "stribeck_velocity": {"value": 0.1173, "std": 0.0089, "unit": "rad/s"},
                },
                "certain": "Besides the rigid-body model, a torque of 8.9 N m RMS on joint2 is needed.",
                "evidence": {"log_odds": 1843.7, "probability": 0.97, "heldout_gain": 0.88},
                "alternatives": [
                    {
                        "effect": "load_dependent_friction",
                        "probability": 0.03,
                        "separate_by": "Move joint2 slowly through the same poses with and without a known mass.",
                    }
                ],
            },
            {
                "effect": "transmission_coupling",
                "joints": ["joint5", "joint6"],
                "where": "On joint5 and joint6, in proportion to the difference of their speeds.",
                "parameters": {"viscous": {"value": 2.31, "std": 0.04, "unit": "N m s/rad"}},
                "certain": "Besides the rigid-body model, a torque of 1.2 N m RMS on joint5 is needed.",
                "evidence": {"log_odds": 412.2, "probability": 0.999, "heldout_gain": 0.61},
                "alternatives": [],
            },
        ],
        "unexplained": [
            {
                "joints": ["joint5"],
                "where": "On joint5 between -0.4 and 0.1 rad, while it moves down.",
                "share": 0.34,
                "p_value": 0.0004,
            }
        ],
        "not_testable": [
            {
                "effect": "rotor_inertia",
                "joints": ["joint1", "joint2"],
                "needs": "Faster reversals: accelerations above 8 rad/s^2 in at least two poses of the arm.",
            },
            {"effect": "backlash", "joints": list(JOINTS), "needs": "An encoder on the link side."},
        ],
        "fit": fit,
        "notes": [
            "wave_2.csv: 14 samples were missing and the gaps were left out.",
            "Velocities and accelerations come from the positions, smoothed below 12 Hz.",
        ],
        "provenance": {
            "version": "0.1.0",
            "command": "irb140 diagnose wave_1.csv wave_2.csv wave_3.csv --out d --inertial-uncertainty 0.05",
            "robot": {"name": "irb140", "joints": list(JOINTS), "sha256": "5e" * 32},
            "recordings": [
                {"file": f"wave_{i}.csv", "sha256": f"{i}a" * 32, "rows": 7501, "rate": 250.0, "duration": 30.0}
                for i in (1, 2, 3)
            ],
            "options": {"inertial_uncertainty": 0.05, "effects": "all"},
            "date": "2026-03-14",
        },
        "summary": "The model leaves out Stribeck friction on joint2 and a coupling of joint5 and joint6. "
        "With both, the torque error on unseen data falls from 3.1 to 0.4 N m; on joint5 a third of what is left has a "
        "cause that the library does not know.",
    }


def example_views() -> Views:
    """The matching views: maps, motions, ranking, spectra, inertials and notes."""
    rng = np.random.default_rng(7)
    q_edges, qd_edges = np.linspace(-1.5, 1.5, 19), np.linspace(-2.0, 2.0, 17)
    q, qd = (0.5 * (e[1:] + e[:-1]) for e in (q_edges, qd_edges))
    t = np.arange(0.0, 12.0, 0.02)
    maps, spectra = {}, {}
    motions = tuple(Traces(f"wave_{i}.csv", t.tolist(), {}) for i in (3, 1))
    for i, name in enumerate(JOINTS):
        size = 8.0 / (1 + i)
        nominal = size * np.tanh(qd / 0.2)[None, :] + 0.3 * size * np.sin(2 * q)[:, None]
        corrected = 0.06 * size * rng.standard_normal(nominal.shape)
        hidden = (q[:, None] / 1.5) ** 2 + (qd[None, :] / 2.0) ** 2 > 1.0
        blank = lambda grid, hidden=hidden: [  # noqa: E731
            [None if h else float(v) for v, h in zip(row, hide, strict=True)]
            for row, hide in zip(grid, hidden, strict=True)
        ]
        maps[name] = Maps(q_edges.tolist(), qd_edges.tolist(), blank(nominal), blank(corrected), "N m")
        phase = 0.7 * t + 0.4 * i
        rigid = 4 * size * np.sin(phase) + size * np.sin(2.3 * phase)
        friction = size * np.tanh(6 * np.cos(phase))
        noise = 0.08 * size * rng.standard_normal(t.size)
        swing = 1.4 * np.sin(phase)
        motions[0].joints[name] = {
            "q": swing.tolist(),
            "qd": (1.4 * 0.7 * np.cos(phase)).tolist(),
            "measured": (rigid + friction + noise).tolist(),
            "nominal": (0.96 * rigid).tolist(),
            "refit": (1.03 * rigid + 0.2 * size * np.cos(phase)).tolist(),
            "corrected": (rigid + 0.97 * friction).tolist(),
        }
        # The second one is half as fast, and a value of it is missing.
        motions[1].joints[name] = {
            key: [None if i == 3 else (0.5 if key == "qd" else 1.0) * (v or 0.0) for i, v in enumerate(values)]
            for key, values in motions[0].joints[name].items()
        }
        f = np.geomspace(0.1, 50.0, 60)
        spectra[name] = {
            "f": f.tolist(),
            "nominal": (size / (1 + f)).tolist(),
            "refit": (0.6 * size / (1 + f)).tolist(),
            "corrected": (0.05 * size * np.ones_like(f)).tolist(),
        }
    return Views(
        joints=JOINTS,
        recordings=("wave_1.csv", "wave_2.csv", "wave_3.csv"),
        maps=maps,
        motions=motions,
        ranking=(
            Ranked("stribeck_friction", ("joint2",), 1843.7, 0.97, True, "alone"),
            Ranked("coulomb_friction", ("joint2",), 1790.1, 0.0, False, "alone"),
            Ranked("load_dependent_friction", ("joint2",), 1836.0, 0.03, False, "alone"),
            Ranked("transmission_coupling", ("joint5", "joint6"), 412.2, 0.999, True, "alone"),
            Ranked("viscous_friction", ("joint5",), 260.4, 0.0, False, "alone"),
            Ranked("torque_offset", ("joint3",), -6.1, 0.0, False, "given the others"),
            Ranked("viscous_friction", ("joint5",), 3.2, 0.01, False, "given the others"),
        ),
        residual_spectrum=spectra,
        unexplained=(UnexplainedTorque(
            "joint4", "position of joint5 [rad]", "N m", ([0.1, 0.2, 0.4], [1.0, 1.5, 2.0]), ([0.3, 0.5], [-1.7, -2.0])
        ),),
        inertials=(LinkShift("link2", 2.6, 16.06, 17.31, "link2 is 7.8 % heavier than the model says."),),
        notes=example_diagnosis().notes,
    )
