"""MJCF compiled without what dynamics has no use for: meshes and textures need not be there."""

import pathlib
from typing import NamedTuple

import mujoco
import numpy as np

from irb140_jax.robot.inertia import NEGLIGIBLE, described, is_lopsided, possible

# Only seen, touched or measured; what they refer to may go with them.
UNSEEN = ("sensors", "keys", "pairs", "excludes", "skins", "cameras", "lights")
# Assets, after the geometries that use them.
ASSETS = ("materials", "textures", "hfields")


class LightModel(NamedTuple):
    """A compiled model.

    Attributes:
        model: The model.
        notes: What was mended, by body, as the rest of "link x has ...".
        unweighed: Bodies whose mass is unknown, since it is that of a mesh that is not there: its file, by their names.
    """

    model: mujoco.MjModel
    notes: dict[str, str]
    unweighed: dict[str, str]


def light_model(path: pathlib.Path) -> LightModel:
    """The compiled model; geometries stay where a body has its mass from them, meshes too if their files are there.

    Args:
        path: MJCF file.

    Raises:
        ValueError: MuJoCo can't compile it.
    """
    spec = mujoco.MjSpec.from_file(str(path))
    for kind in UNSEEN:
        _delete_all(spec, kind)
    unweighed: dict[str, str] = {}
    for geom in list(spec.geoms):
        weighs = _weighs(spec, geom)
        missing = _missing_file(spec, geom) if weighs else None
        if missing:
            unweighed[_named(geom.parent)] = missing
        if missing or (_is_mesh(geom) and not weighs):
            spec.delete(geom)
        else:
            geom.material = ""
    for kind in ASSETS:
        _delete_all(spec, kind)
    used = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)
    notes = {_named(body): note for body in spec.bodies if (note := _mended(body))}
    spec.compiler.boundmass = spec.compiler.boundmass or NEGLIGIBLE
    spec.compiler.boundinertia = spec.compiler.boundinertia or NEGLIGIBLE
    return LightModel(spec.compile(), notes, unweighed)


def _delete_all(spec: mujoco.MjSpec, kind: str) -> None:
    for element in list(getattr(spec, kind)):
        spec.delete(element)


def _named(body: mujoco.MjsBody) -> str:
    """The body's name; one without gets one."""
    body.name = body.name or f"body under {body.parent.name or 'a nameless one'}"
    return body.name


def _missing_file(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> str | None:
    """The file of the geometry's mesh, if it is not where MuJoCo would look for it."""
    mesh = next((m for m in spec.meshes if m.name == geom.meshname), None) if geom.meshname else None
    if mesh is None or not mesh.file:
        return None
    compiler = geom.compiler
    name = pathlib.Path(mesh.file).name if spec.strippath else mesh.file
    file = pathlib.Path(spec.modelfiledir) / compiler.meshdir / name
    return None if file.is_file() else str(file)


def _is_mesh(geom: mujoco.MjsGeom) -> bool:
    shapes = (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_SDF, mujoco.mjtGeom.mjGEOM_HFIELD)
    return bool(geom.meshname or geom.hfieldname) or geom.type in shapes


def _weighs(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> bool:
    """Whether its body has its mass from its geometries."""
    always = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    body = geom.parent
    return body != spec.worldbody and (always or not body.explicitinertial) and geom.mass != 0 and geom.density != 0


def _mended(body: mujoco.MjsBody) -> str | None:
    """Give a body with an inertia that no body has the nearest possible one; what was done, or None."""
    if not body.explicitinertial:
        return None
    full, diagonal = np.asarray(body.fullinertia), np.asarray(body.inertia)
    xx, yy, zz, xy, xz, yz = full if not np.isnan(full[0]) else (*diagonal, 0.0, 0.0, 0.0)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not np.all(np.isfinite(inertia)) or not is_lopsided(inertia):
        return None
    mended = possible(inertia)
    if np.isnan(full[0]):
        body.inertia = np.diag(mended)
    else:
        body.fullinertia = mended[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return (
        f"principal moments of inertia {described(inertia)}, of which the largest exceeds "
        f"the sum of the others; no body has that: it counts with {described(mended)}"
    )
