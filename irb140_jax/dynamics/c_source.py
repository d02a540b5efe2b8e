"""Inverse dynamics of a robot as plain C, for controllers without JAX: a recursion over its links."""

import numpy as np

from irb140_jax.robot import Robot

_SOURCE = """/* Inverse dynamics of '@NAME@' by the Newton-Euler recursion; needs nothing but the C standard library.
 * tau[i]: torque [N m] or force [N] of joint i under motion q, qd, qdd [rad or m, and per s, per s^2]. */
#include <math.h>
#define N @N@
typedef double vec[3];
@TABLES@

static void rotate(const double R[9], const vec x, vec y) {
    for (int i = 0; i < 3; i++) y[i] = R[3*i] * x[0] + R[3*i+1] * x[1] + R[3*i+2] * x[2];
}
static void rotate_back(const double R[9], const vec x, vec y) {
    for (int i = 0; i < 3; i++) y[i] = R[i] * x[0] + R[3+i] * x[1] + R[6+i] * x[2];
}
static void cross_add(const vec a, const vec b, vec y) {
    y[0] += a[1] * b[2] - a[2] * b[1];
    y[1] += a[2] * b[0] - a[0] * b[2];
    y[2] += a[0] * b[1] - a[1] * b[0];
}

void inverse_dynamics(const double q[N], const double qd[N], const double qdd[N], double tau[N]) {
    double R[N][9];
    vec p[N], f[N], m[N], turn[N], spin_up[N], rise[N];
    const vec still = {0, 0, 0}, base = {-GRAVITY[0], -GRAVITY[1], -GRAVITY[2]};
    for (int i = 0; i < N; i++) {
        const int before = PARENT[i];
        const double *old_w = before < 0 ? still : turn[before], *old_dw = before < 0 ? still : spin_up[before];
        const double *old_a = before < 0 ? base : rise[before];
        double *w = turn[i], *dw = spin_up[i], *a = rise[i];
        for (int k = 0; k < 3; k++) { w[k] = old_w[k]; dw[k] = old_dw[k]; a[k] = old_a[k]; }
        const double *z = AXIS[i], x = q[i] - REFERENCE[i];
        double S[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        vec slide = {0, 0, 0}, t;
        if (SLIDE[i]) {
            for (int k = 0; k < 3; k++) slide[k] = x * z[k];
        } else { /* Rodrigues */
            double s = sin(x), c = cos(x);
            for (int k = 0; k < 3; k++) for (int l = 0; l < 3; l++) S[3*k+l] = (k == l) * c + (1 - c) * z[k] * z[l];
            S[1] -= s * z[2]; S[2] += s * z[1]; S[3] += s * z[2]; S[5] -= s * z[0]; S[6] -= s * z[1]; S[7] += s * z[0];
        }
        rotate(ROTATION[i], slide, t);
        for (int k = 0; k < 3; k++) p[i][k] = POSITION[i][k] + t[k];
        for (int k = 0; k < 3; k++) for (int l = 0; l < 3; l++) {
            R[i][3*k+l] = 0;
            for (int h = 0; h < 3; h++) R[i][3*k+l] += ROTATION[i][3*k+h] * S[3*h+l];
        }
        /* acceleration of this link's origin, still in the axes of the link before */
        vec wxp = {0, 0, 0}, v;
        cross_add(w, p[i], wxp);
        cross_add(dw, p[i], a);
        cross_add(w, wxp, a);
        rotate_back(R[i], a, v); for (int k = 0; k < 3; k++) a[k] = v[k];
        rotate_back(R[i], w, v); for (int k = 0; k < 3; k++) w[k] = v[k];
        rotate_back(R[i], dw, v); for (int k = 0; k < 3; k++) dw[k] = v[k];
        vec spin = {qd[i] * z[0], qd[i] * z[1], qd[i] * z[2]};
        if (SLIDE[i]) {
            vec twice = {2 * w[0], 2 * w[1], 2 * w[2]};
            cross_add(twice, spin, a);
            for (int k = 0; k < 3; k++) a[k] += qdd[i] * z[k];
        } else {
            cross_add(w, spin, dw);
            for (int k = 0; k < 3; k++) { w[k] += spin[k]; dw[k] += qdd[i] * z[k]; }
        }
        /* force and moment that this link's motion takes, about its origin */
        vec wxc = {0, 0, 0}, ac = {a[0], a[1], a[2]}, Iw;
        cross_add(w, COM[i], wxc);
        cross_add(dw, COM[i], ac);
        cross_add(w, wxc, ac);
        for (int k = 0; k < 3; k++) f[i][k] = MASS[i] * ac[k];
        rotate(INERTIA[i], w, Iw);
        rotate(INERTIA[i], dw, m[i]);
        cross_add(w, Iw, m[i]);
        cross_add(COM[i], f[i], m[i]);
    }
    for (int i = N - 1; i >= 0; i--) {
        const double *z = AXIS[i], *load = SLIDE[i] ? f[i] : m[i], x = qd[i];
        tau[i] = z[0] * load[0] + z[1] * load[1] + z[2] * load[2];
        tau[i] += ARMATURE[i] * qdd[i] + DAMPING[i] * x + FRICTION[i] * ((x > 0) - (x < 0));
        tau[i] += STIFFNESS[i] * (q[i] - REST[i]);
        if (PARENT[i] >= 0) {
            double *on = f[PARENT[i]], *about = m[PARENT[i]];
            vec force, moment;
            rotate(R[i], f[i], force);
            rotate(R[i], m[i], moment);
            cross_add(p[i], force, moment);
            for (int k = 0; k < 3; k++) { on[k] += force[k]; about[k] += moment[k]; }
        }
    }
}
"""


def c_source(robot: Robot) -> str:
    """C code of `inverse_dynamics(q, qd, qdd, tau)` for this robot; all its numbers are in it, to the last digit.

    Args:
        robot: Any robot with n joints; what is identified of it included.

    Returns:
        A translation unit that needs only the C standard library; equal to `dynamics.inverse_dynamics` to round-off.

    Source: Luh, Walker, Paul (1980), On-line computational scheme for mechanical manipulators.
    """
    tables = {
        "ROTATION": robot.rotation, "POSITION": robot.position, "AXIS": robot.axis, "REFERENCE": robot.reference,
        "MASS": robot.mass, "COM": robot.com, "INERTIA": robot.inertia, "ARMATURE": robot.armature,
        "DAMPING": robot.damping, "FRICTION": robot.frictionloss, "STIFFNESS": robot.stiffness, "REST": robot.springref,
    }  # fmt: skip
    lines = [_table(name, np.asarray(values).reshape(robot.n, -1)) for name, values in tables.items()]
    lines.append("static const int SLIDE[N] = {" + ", ".join(str(int(s)) for s in robot.is_slide) + "};")
    lines.append("static const int PARENT[N] = {" + ", ".join(str(int(p)) for p in robot.parent) + "};")
    lines.append(f"static const double GRAVITY[3] = {_row(np.asarray(robot.gravity))};")
    name = "".join(c if c.isprintable() and c not in "*/" else " " for c in robot.name)
    return _SOURCE.replace("@NAME@", name).replace("@N@", str(robot.n)).replace("@TABLES@", "\n".join(lines))


def _table(name: str, values: np.ndarray) -> str:
    if values.shape[1] == 1:
        return f"static const double {name}[N] = {_row(values[:, 0])};"
    rows = ",\n    ".join(_row(row) for row in values)
    return f"static const double {name}[N][{values.shape[1]}] = {{\n    {rows}}};"


def _row(values: np.ndarray) -> str:
    return "{" + ", ".join(f"{float(v):.17g}" for v in values) + "}"
