/* Inverse dynamics of 'irb140, first 3 joints' by the Newton-Euler recursion; needs nothing but the C standard library.
 * tau[i]: torque [N m] or force [N] of joint i under motion q, qd, qdd [rad or m, and per s, per s^2]. */
#include <math.h>
#define N 3
typedef double vec[3];
static const double ROTATION[N][9] = {
    {1, 0, 0, 0, 1, 0, 0, 0, 1},
    {1, 0, 0, 0, 1, 0, 0, 0, 1},
    {1, 0, 0, 0, 1, 0, 0, 0, 1}};
static const double POSITION[N][3] = {
    {0, 0, 0.35199999999999998},
    {0.070000000000000007, 0, 0},
    {0, 0, 0.35999999999999999}};
static const double AXIS[N][3] = {
    {0, 0, 1},
    {0, 1, 0},
    {0, 1, 0}};
static const double REFERENCE[N] = {0, 0, 0};
static const double MASS[N] = {34.513170000000002, 16.062539999999998, 21.130030000000001};
static const double COM[N][3] = {
    {0.028134820009999995, 0.043835584279999999, -0.08854335998333332},
    {-0.009736825147, -0.092578942086666671, 0.19826700680000003},
    {0.077719310273805103, 0.0058392417998232807, -0.0048323506070584365}};
static const double INERTIA[N][9] = {
    {0.5087118602666667, -0.0014840003963333332, -0.052246263279999997, -0.0014840003963333332, 0.46135511460000006, -0.068729332986666669, -0.052246263279999997, -0.068729332986666669, 0.45553471733333334},
    {0.32967598166666667, 0.001094078779666667, -0.0038804506843333336, 0.001094078779666667, 0.27804722063333337, 0.038050434080000001, -0.0038804506843333336, 0.038050434080000001, 0.095124025179999988},
    {0.076204471820993172, 0.015263396776504113, -0.00045693403257101721, 0.015263396776504113, 0.5125190450599969, 0.0008979446112595777, -0.00045693403257101721, 0.0008979446112595777, 0.49711403411174421}};
static const double ARMATURE[N] = {3, 2, 0.80000000000000004};
static const double DAMPING[N] = {0, 0, 0};
static const double FRICTION[N] = {0, 0, 0};
static const double STIFFNESS[N] = {0, 0, 0};
static const double REST[N] = {0, 0, 0};
static const int SLIDE[N] = {0, 0, 0};
static const int PARENT[N] = {-1, 0, 1};
static const double GRAVITY[3] = {0, 0, -9.8100000000000005};

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
