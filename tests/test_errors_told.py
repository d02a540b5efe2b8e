"""The errors that a diagnosis tells are those of the model that it gives, also where that is no sum of columns."""

import mujoco
import numpy as np
from helpers_native import CYLINDRICAL, recorded

from irb140_jax.mismatch import diagnose, predict
from irb140_jax.mismatch.selection import explain as loop
from irb140_jax.robot import robot_from_model


def test_a_model_that_is_not_what_was_fitted_errs_by_what_is_told(monkeypatch):
    """Gravity that leans by 0.3 rad, and no round to settle the product of its lean and the links' centres of mass."""
    monkeypatch.setattr(loop, "MOST_ROUNDS", 2)

    def hide(true):
        true.opt.gravity[:] = 9.81 * np.array([0.2, -0.22, -1.0])
        true.body_ipos[1, :2] += [-0.06, 0.08]

    rng, xml = np.random.default_rng(0), CYLINDRICAL
    logs = [recorded(xml, hide, rng) for _ in range(2)]
    result = diagnose(robot_from_model(mujoco.MjModel.from_xml_string(xml), source="native"), logs)
    fit = result.diagnosis.to_json()["fit"]
    inner = [(r.t > r.t[0] + 0.5) & (r.t < r.t[-1] - 0.5) for r in logs]  # where the smoother has neighbours
    off = [(r.tau - predict(result.model, r)["corrected"])[at, 0] for r, at in zip(logs, inner, strict=True)]
    error = np.sqrt(np.mean(np.concatenate(off) ** 2))
    turn = fit[logs[0].joint_names[0]]
    assert turn["rmse_corrected"] > 0.9 * error and error > 10.0 * turn["noise_floor"]
