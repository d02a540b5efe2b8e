"""Hidden physics around the arm: how it stands, what it holds, what pulls at it and what it touches."""

import math

import mujoco
import numpy as np

from irb140_jax.recordings.concealed.hidden import Hidden, Plant, Survey
from irb140_jax.recordings.concealed.plant import rigid_torque


class GravitySpring(Hidden):
    """k (q - rest): a counterbalance or a cable."""

    slug = "gravity_spring"
    units = {"stiffness": "{tau}/{q}", "rest": "{q}"}
    amplitudes = ("stiffness",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        low, high = np.quantile(survey.q[:, joints[0]], [0.1, 0.9])
        return {"stiffness": 1.0, "rest": rng.uniform(low, high)}

    def pull(self, q):
        return self.parameters["stiffness"] * (q - self.parameters["rest"])

    def torque(self, survey: Survey):
        return self.on_joint(survey, self.pull(survey.q[:, self.joint]))

    def act(self, plant: Plant):
        plant.torque[self.joint] -= self.pull(plant.q[self.joint])


class GravityTilt(Hidden):
    """The base leans by `tilt` about an axis across gravity; at most 3 degrees."""

    slug = "gravity_tilt"
    units = {"tilt": "rad", "direction": "rad"}
    amplitudes = ("tilt",)
    largest = {"tilt": math.radians(3.0)}
    joints_acted_on = 0

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"tilt": 0.01, "direction": rng.uniform(-math.pi, math.pi)}

    def install(self, model, dofs):
        g = model.opt.gravity.copy()
        down = g / max(float(np.linalg.norm(g)), 1e-300)
        across = np.cross(down, [1.0, 0.0, 0.0] if abs(down[0]) < 0.9 else [0.0, 1.0, 0.0])
        across /= np.linalg.norm(across)
        angle = self.parameters["direction"]
        side = math.cos(angle) * across + math.sin(angle) * np.cross(down, across)
        model.opt.gravity[:] = math.cos(self.parameters["tilt"]) * g + math.sin(
            self.parameters["tilt"]) * np.linalg.norm(g) * side


class Payload(Hidden):
    """A ball of some mass held near the tool."""

    slug = "payload"
    units = {"mass": "kg", "x": "m", "y": "m", "z": "m"}
    amplitudes = ("mass",)
    joints_acted_on = 0

    RADIUS = 0.04  # [m] of the ball

    @classmethod
    def shapes(cls, joints, survey, rng):
        tool = tool_in_body(survey.model)[1] + rng.uniform(-0.04, 0.04, size=3)
        return {"mass": 0.1, **dict(zip("xyz", tool.tolist(), strict=True))}

    def install(self, model, dofs):
        body, mass = tool_in_body(model)[0], self.parameters["mass"]
        if mass == 0.0:
            return
        where = np.array([self.parameters[k] for k in "xyz"])
        R, own, com = np.zeros(9), model.body_mass[body], model.body_ipos[body].copy()
        mujoco.mju_quat2Mat(R, model.body_iquat[body])
        R = R.reshape(3, 3)
        joint_com = (own * com + mass * where) / (own + mass)
        about = lambda m, r: m * (r @ r * np.eye(3) - np.outer(r, r))  # noqa: E731
        inertia = R @ np.diag(model.body_inertia[body]) @ R.T + about(own, com - joint_com)
        inertia += 0.4 * mass * self.RADIUS**2 * np.eye(3) + about(mass, where - joint_com)
        moments, axes = np.linalg.eigh(inertia)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        mujoco.mju_mat2Quat(model.body_iquat[body], axes.ravel())
        model.body_inertia[body], model.body_mass[body], model.body_ipos[body] = moments, own + mass, joint_com
        mujoco.mj_setConst(model, mujoco.MjData(model))


class EncoderOffset(Hidden):
    """q_logged = q + offset; at most 0.1 rad (or 0.1 m)."""

    slug = "encoder_offset"
    units = {"offset": "{q}"}
    amplitudes = ("offset",)
    largest = {"offset": 0.1}

    @classmethod
    def shapes(cls, joints, survey, rng):
        return {"offset": 0.01 * rng.choice([-1.0, 1.0])}

    def torque(self, survey: Survey):
        moved = survey.q.copy()
        moved[:, self.joint] -= self.parameters["offset"]
        return rigid_torque(survey.model, moved, survey.qd, survey.qdd) - survey.load

    def begin(self, plant: Plant):
        plant.zero[self.joint] += self.parameters["offset"]


class _AtTool(Hidden):
    """A force of the surroundings on the tool."""

    joints_acted_on = 0

    def force(self, t, recording, point):
        """Force on the tool [N], world axes, shape (3,)."""
        raise NotImplementedError

    def torque(self, survey: Survey):
        model, data, torque = survey.model, mujoco.MjData(survey.model), np.zeros_like(survey.tau)
        body, place = tool_in_body(model)
        for k in range(len(survey.t)):
            data.qpos[:] = survey.q[k]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            push(model, data, body, place, lambda p: self.force(survey.t[k], survey.recording[k], p), torque[k])  # noqa: B023
        return -torque

    def begin(self, plant: Plant):
        self._body, self._place = tool_in_body(plant.model)

    def act(self, plant: Plant):
        # The engine's step moves the joints last: its bodies still stand where they stood before it.
        mujoco.mj_kinematics(plant.model, plant.data)
        mujoco.mj_comPos(plant.model, plant.data)
        push(plant.model, plant.data, self._body, self._place,
             lambda p: self.force(plant.t, plant.recording, p), plant.inner)


class Contact(_AtTool):
    """A smooth, springy wall: force = stiffness x depth along its normal, touched during a tenth of the time."""

    slug = "contact"
    units = {"stiffness": "N/m", "normal_x": "1", "normal_y": "1", "normal_z": "1", "position": "m"}
    amplitudes = ("stiffness",)

    @classmethod
    def shapes(cls, joints, survey, rng):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        # The wall stands across the way of the tool, so that the tool is behind it during a tenth of the samples, or
        # a twentieth of its way where it rests at the far end.
        along = tool_path(survey) @ normal
        position = max(float(np.quantile(along, 0.1)), float(along.min() + 0.05 * np.ptp(along)))
        return {"stiffness": 1.0, **dict(zip(("normal_x", "normal_y", "normal_z"), normal.tolist(), strict=True)),
                "position": position}

    def force(self, t, recording, point):
        p = self.parameters
        normal = np.array([p["normal_x"], p["normal_y"], p["normal_z"]])
        return p["stiffness"] * max(0.0, p["position"] - float(point @ normal)) * normal


class ExternalWrench(_AtTool):
    """A constant force on the tool from t0 to t1 of the first recording, rising and falling within 0.1 s.

    Its share is counted while it lasts.
    """

    slug = "external_wrench"
    units = {"t0": "s", "t1": "s", "force_x": "N", "force_y": "N", "force_z": "N"}
    amplitudes = ("force_x", "force_y", "force_z")
    RAMP = 0.1  # [s]

    @classmethod
    def shapes(cls, joints, survey, rng):
        end = float(survey.t[survey.recording == 0].max())
        length = end * rng.uniform(0.1, 0.2)
        start = rng.uniform(0.15 * end, 0.85 * end - length)
        force = rng.normal(size=3)
        return {"t0": start, "t1": start + length, **dict(
            zip(("force_x", "force_y", "force_z"), (force / np.linalg.norm(force)).tolist(), strict=True))}

    def share(self, survey: Survey):
        during = (survey.recording == 0) & (survey.t >= self.parameters["t0"]) & (survey.t <= self.parameters["t1"])
        return super().share(survey) / math.sqrt(max(float(np.mean(during)), 1e-300))

    def force(self, t, recording, point):
        p = self.parameters
        rise = min(t - p["t0"], p["t1"] - t) / self.RAMP
        if recording != 0 or rise <= 0.0:
            return np.zeros(3)
        return min(1.0, rise) * np.array([p["force_x"], p["force_y"], p["force_z"]])


def tool_in_body(model: mujoco.MjModel) -> tuple[int, np.ndarray]:
    """The last moving body, and where the tool is on it [m]: its last site, or else its centre of mass."""
    body = int(model.jnt_bodyid[-1])
    sites = [s for s in range(model.nsite) if model.site_bodyid[s] == body]
    return body, (model.site_pos[sites[-1]] if sites else model.body_ipos[body]).copy()


def tool_path(survey: Survey) -> np.ndarray:
    """Positions of the tool in the world along the surveyed motions [m], shape (T, 3)."""
    data, path = mujoco.MjData(survey.model), np.empty((len(survey.t), 3))
    body, place = tool_in_body(survey.model)
    for k, q in enumerate(survey.q):
        data.qpos[:] = q
        mujoco.mj_kinematics(survey.model, data)
        path[k] = data.xpos[body] + data.xmat[body].reshape(3, 3) @ place
    return path


def push(model, data, body, place, force_at, torque) -> None:
    """Add to the joint torques what a force on the tool makes of itself; `force_at` maps a point to a force."""
    point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ place
    force = force_at(point)
    if force.any():
        mujoco.mj_applyFT(model, data, force, np.zeros(3), point, body, torque)
