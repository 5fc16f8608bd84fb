"""Gains of paper 5's preview controller by SciPy: the values in crates/instep-kick/tests/it/riccati.rs.

Needs numpy and scipy (made with scipy 1.17.1). Prints, for each case, P, K and some of the preview gains, then the
zero-moment point of a reference simulation of the closed loop on a step, then a Kalman filter's gains for the same model.
"""

import numpy as np
from scipy.linalg import solve_discrete_are

G = 9.81


def model(dt, z):
    a = np.array([[1, dt, dt * dt / 2], [0, 1, dt], [0, 0, 1]])
    b = np.array([[dt**3 / 6], [dt * dt / 2], [dt]])
    return a, b, np.array([[1, 0, -z / G]])


def show(name, values):
    print(name, "[" + ", ".join(repr(float(v)) for v in np.ravel(values)) + "]")


for dt, z, q, r, n in [(0.012, 0.26, 1.0, 1e-6, 134), (0.005, 0.814, 1.0, 1e-6, 320), (0.01, 0.35, 2.0, 1e-8, 200)]:
    a, b, c = model(dt, z)
    p = solve_discrete_are(a, b, c.T @ c * q, np.array([[r]]))
    s = r + (b.T @ p @ b)[0, 0]
    k = b.T @ p @ a / s
    closed = (a - b @ k).T
    f = [float((b.T @ np.linalg.matrix_power(closed, i) @ c.T)[0, 0]) * q / s for i in range(n)]
    print("case", dt, z, q, r, n)
    show("P", p)
    show("K", k)
    show("f 1, 2, 10, 50, n", [f[0], f[1], f[9], f[49], f[-1]])
    # A step of 5 cm after 0.6 s, from rest.
    reference = lambda i: 0.05 if i >= round(0.6 / dt) else 0.0
    x, zmp, com = np.zeros((3, 1)), [], []
    for i in range(round(1.5 / dt)):
        u = -(k @ x)[0, 0] + sum(f[j] * reference(i + 1 + j) for j in range(n))
        x = a @ x + b * u
        zmp.append((c @ x)[0, 0])
        com.append(x[0, 0])
    at = [round(t / dt) for t in (0.3, 0.5, 0.6, 0.7, 1.0, 1.4)]
    show("zmp at 0.3 0.5 0.6 0.7 1.0 1.4 s", [zmp[i] for i in at])
    show("com", [com[i] for i in at])

dt, z = 0.012, 0.26
a, b, c = model(dt, z)
h = np.vstack([[1.0, 0, 0], c])
noise = np.diag([0.002**2, 0.01**2])
p = solve_discrete_are(a.T, h.T, b @ b.T * 20.0**2, noise)
show("Kalman gain", p @ h.T @ np.linalg.inv(h @ p @ h.T + noise))
