"""What every hidden effect is: physics put into a MuJoCo plant, with a strength set by its share of the torque."""

import copy
from collections.abc import Sequence
from typing import ClassVar, NamedTuple, TypeVar

import mujoco
import numpy as np

from irb140_jax.recordings.concealed.plant import rigid_torque


class Plant:
    """The true arm while it runs; effects read and change it at every step.

    Attributes:
        model, data: MuJoCo's; `model` may have joints inside transmissions beside the named ones.
        qpos, dofs: Addresses of the named joints.
        inside: Addresses of positions inside transmissions, by joint.
        dt, t: Step and time [s].
        q, qd: True positions and velocities of the named joints, shape (n,).
        zero: Error of the encoders' zeros, shape (n,).
        torque: Torque on the named joints: starts as the logged one, effects change it in place, shape (n,).
        friction: Level of dry friction at this step: starts as the model's own, effects add to it, shape (n,).
        inner: Torque on all degrees of freedom, also those inside transmissions, shape (model.nv,).
        load: Torque that the gears transmitted at the step before, shape (n,).
        recording: Index of the recording.
    """

    def __init__(self, model: mujoco.MjModel, names: Sequence[str], recording: int):
        self.model, self.data = model, mujoco.MjData(model)
        self.qpos = np.array([model.joint(name).qposadr[0] for name in names])
        self.dofs = np.array([model.joint(name).dofadr[0] for name in names])
        joints = {model.joint(i).name: int(model.jnt_qposadr[i]) for i in range(model.njnt)}
        self.inside = {j: joints[f"{name} inside"] for j, name in enumerate(names) if f"{name} inside" in joints}
        self.dt, self.t, self.recording = float(model.opt.timestep), 0.0, recording
        self.own_friction = model.dof_frictionloss[self.dofs].copy()
        n = len(names)
        self.q, self.qd, self.load = np.zeros(n), np.zeros(n), np.zeros(n)
        self.zero, self.torque, self.friction = np.zeros(n), np.zeros(n), np.zeros(n)
        self.inner = np.zeros(model.nv)


class Log(NamedTuple):
    """What happened, at every step of the engine and without sensor noise.

    Attributes:
        t: Time [s], shape (T,).
        q: Joint positions as the encoders see them, wrong zeros and motor sides included, shape (T, n).
        qd, qdd: True joint velocities and accelerations, shape (T, n).
        tau: What the controller logged, shape (T, n).
        q_link: Joint positions behind the transmission, shape (T, n).
    """

    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    tau: np.ndarray
    q_link: np.ndarray


class Survey(NamedTuple):
    """What the rigid arm does along all motions together; strengths are set on it before anything is simulated.

    Attributes:
        model: The arm without hidden effects.
        t: Time in each sample's own recording [s], shape (T,).
        q, qd, qdd: The motion, shape (T, n).
        load: The model's torque, shape (T, n).
        tau: That and the model's own dry friction, shape (T, n).
        recording: Index of each sample's recording, shape (T,).
    """

    model: mujoco.MjModel
    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    load: np.ndarray
    tau: np.ndarray
    recording: np.ndarray

    def peak(self, joint: int) -> float:
        """Largest speed of a joint [rad/s or m/s]."""
        return float(np.abs(self.qd[:, joint]).max())

    def rate_of(self, values: np.ndarray) -> np.ndarray:
        """Time derivative of samples, recording by recording, shape as given."""
        rate = np.empty_like(values)
        for k in range(int(self.recording[-1]) + 1):
            rows = self.recording == k
            rate[rows] = np.gradient(values[rows], self.t[rows], axis=0)
        return rate

    def rms(self, joint: int) -> float:
        """Root mean square of a joint's torque [N m or N]."""
        return float(np.sqrt(np.mean(self.tau[:, joint] ** 2)))

    def is_slide(self, joint: int) -> bool:
        """Whether the joint is prismatic."""
        return bool(self.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE)


H = TypeVar("H", bound="Hidden")  # typing.Self would stop the check of shapes at import


class Hidden:
    """A kind of hidden physics on given joints, with given parameters.

    Class attributes:
        slug: Name in the vocabulary.
        units: Parameter -> unit; {tau} and {q} stand for N m, rad or for N, m.
        amplitudes: Parameters to which the torque is proportional; they are scaled to the wanted share.
        largest: Largest believable size of an amplitude; where it is reached, the share is smaller than wanted.
        joints_acted_on: How many joints one instance acts on; 0: on all of them.
    """

    slug: ClassVar[str]
    units: ClassVar[dict[str, str]]
    amplitudes: ClassVar[tuple[str, ...]]
    largest: ClassVar[dict[str, float]] = {}
    joints_acted_on: ClassVar[int] = 1

    def __init__(self, joints: Sequence[int], parameters: dict[str, float]):
        self.joints, self.parameters = tuple(joints), dict(parameters)
        self.joint = self.joints[0]

    @classmethod
    def drawn(cls: type[H], joints: Sequence[int], share: float, survey: Survey, rng: np.random.Generator) -> H:
        """An instance with shapes drawn at random and amplitudes that give the wanted share.

        Args:
            joints: Indices of the joints it acts on.
            share: Wanted share of the torque, see `share`.
            survey: What the nominal arm does.
            rng: Source of the shapes.

        Returns:
            The effect.
        """
        unit = cls(joints, cls.shapes(joints, survey, rng))
        factor = share / max(unit.share(survey), 1e-300)
        room = [cls.largest[k] / abs(unit.parameters[k]) for k in cls.largest]
        factor = min([factor, *room])
        scaled = {k: v * factor if k in cls.amplitudes else v for k, v in unit.parameters.items()}
        return cls(joints, scaled)

    @classmethod
    def shapes(cls, joints: Sequence[int], survey: Survey, rng: np.random.Generator) -> dict[str, float]:
        """All parameters, shapes drawn in realistic ranges, amplitudes of any size but in realistic proportion."""
        raise NotImplementedError

    def share(self, survey: Survey) -> float:
        """RMS of this effect's torque as a share of the joint's torque RMS, over all motions together.

        Where it acts on two joints, the root mean square of their shares; where it acts on all, the share of the
        whole vector of torques.
        """
        squares = np.mean(self.torque(survey) ** 2, axis=0)
        rms2 = np.maximum(np.mean(survey.tau**2, axis=0), 1e-300)
        if self.joints_acted_on == 0:
            return float(np.sqrt(squares.sum() / rms2.sum()))
        return float(np.sqrt(np.mean([squares[j] / rms2[j] for j in self.joints])))

    def torque(self, survey: Survey) -> np.ndarray:
        """What the effect adds to the logged torque along the surveyed motions, to first order, shape (T, n).

        Unless a subclass has a formula: what the native change of the model makes of the rigid-body torque.
        """
        model = copy.copy(survey.model)
        self.install(model, np.arange(model.nv))
        return rigid_torque(model, survey.q, survey.qd, survey.qdd) - survey.load

    def edit(self, spec: mujoco.MjSpec, names: Sequence[str]) -> None:
        """Change the editable model of the true arm, once, before it is compiled."""

    def install(self, model: mujoco.MjModel, dofs: np.ndarray) -> None:
        """Change the compiled model of the true arm, once, where MuJoCo has the effect natively."""

    def measured(self, log: Log) -> Log:
        """What the data logger makes of what happened."""
        return log

    def begin(self, plant: Plant) -> None:
        """Reset whatever state the effect has, at the start of every recording."""

    def act(self, plant: Plant) -> None:
        """Change torque and friction of one step, in place."""

    def told(self, names: Sequence[str], is_slide: Sequence[bool]) -> dict:
        """The truth about this effect, in the words of `diagnosis.json`."""
        words = {"tau": "N", "q": "m"} if is_slide[self.joint] else {"tau": "N m", "q": "rad"}
        parameters = {
            k: {"value": float(v), "unit": self.units[k].format(**words)} for k, v in self.parameters.items()
        }
        return {"effect": self.slug, "joints": [names[j] for j in self.joints], "parameters": parameters}

    def on_joint(self, survey: Survey, values: np.ndarray) -> np.ndarray:
        """A torque on this effect's joint alone, shape (T,), among all joints, shape (T, n)."""
        torque = np.zeros_like(survey.tau)
        torque[:, self.joint] = values
        return torque


def survey_of(model: mujoco.MjModel, motions: Sequence, every: int) -> Survey:
    """What the arm of this model does along the motions, at every so many samples."""
    parts = [(m.t[::every], m.q[::every], m.qd[::every], m.qdd[::every]) for m in motions]
    t, q, qd, qdd = (np.concatenate(x) for x in zip(*parts, strict=True))
    load = rigid_torque(model, q, qd, qdd)
    recording = np.repeat(np.arange(len(parts)), [len(p[0]) for p in parts])
    return Survey(model, t, q, qd, qdd, load, load + model.dof_frictionloss * np.sign(qd), recording)
