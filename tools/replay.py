#!/usr/bin/env python3
"""Does a recorded kick again in MuJoCo's own Python, independently of Instep's world.

    cargo run -- kick --steps out/steps
    cargo run -- kick --engine dynamic --robot nao --ball 0.17,-0.05 --speed 0.7 --steps out/steps
    pip install mujoco==3.17.0
    python3 tools/replay.py out/steps

From the first state alone it steps through the whole kick with the recorded torques, pushes and air, and compares every
state with the recorded one (limit 1e-6). Its inverse check computes at each step, from position, speed and acceleration
alone, which torques the motors must have given, and compares them with those recorded and with the drive's law, read
from the robot's limits: never more than the torque limit, no more than the torque-speed line, no push at or beyond the
speed limit. It checks the air's force on the ball against 1/2 rho c A v^2, and that nothing else touches the world from
outside but a push on the base. Exit code 1 if a check fails.
"""

import json
import pathlib
import sys

import mujoco
import numpy as np

STATE_LIMIT = 1e-6
TORQUE_LIMIT = 2e-4  # what the contact solver leaves where a foot squeezes a stiff ball
DRAG = 0.5 * 1.204 * 0.43  # rho / 2 times the shipped balls' drag coefficient


def main(folder):
    about = json.loads((folder / "steps.json").read_text())
    if mujoco.__version__ != about["mujoco"]:
        sys.exit(f"MuJoCo {mujoco.__version__}; the kick was recorded with {about['mujoco']}")
    model = mujoco.MjModel.from_binary_path(str(folder / "model.mjb"))
    data = mujoco.MjData(model)
    nq, nv, count, width = model.nq, model.nv, about["steps"], about["width"]
    numbers = np.fromfile(folder / "steps.f64", dtype="<f8")
    rows, end = numbers[: count * width].reshape(count, width), numbers[count * width :]
    dt, qpos, qvel = rows[:, 0], rows[:, 1 : 1 + nq], rows[:, 1 + nq : 1 + nq + nv]
    applied = rows[:, 1 + nq + nv : 1 + nq + 2 * nv]
    outside = rows[:, 1 + nq + 2 * nv :].reshape(count, 2, 6)
    qpos, qvel = np.vstack([qpos, end[:nq]]), np.vstack([qvel, end[nq:]])
    base, ball = model.body(about["base"]).id, model.body(about["ball"]).id
    radius = model.geom(about["ball"]).size[0]
    dofs = np.array([model.joint(name).dofadr[0] for name in about["joints"]])
    limit, speed, corner = (np.array(about[key]) for key in ("torque", "speed", "corner"))

    # Forward, from the first state alone. A jump of the ball between two steps is a hand's, and taken over.
    data.qpos[:], data.qvel[:] = qpos[0], qvel[0]
    mujoco.mj_forward(model, data)
    worst_state = worst_torque = worst_law = worst_air = 0.0
    inverse = mujoco.MjData(model)
    for i in range(count):
        free = slice(nq - 7, nq)
        if np.abs(data.qpos[free] - qpos[i][free]).max() > 1e-3:
            data.qpos[free], data.qvel[nv - 6 :] = qpos[i][free], qvel[i][nv - 6 :]
            mujoco.mj_forward(model, data)
        worst_state = max(worst_state, np.abs(data.qpos - qpos[i]).max(), np.abs(data.qvel - qvel[i]).max())
        model.opt.timestep = dt[i]
        data.qfrc_applied[:] = applied[i]
        data.xfrc_applied[:] = 0
        data.xfrc_applied[base], data.xfrc_applied[ball] = outside[i]
        mujoco.mj_step(model, data)

        # Inverse: what forces does this acceleration need? Those that are not contact, friction or passive are applied.
        inverse.qpos[:], inverse.qvel[:], inverse.qacc[:] = qpos[i], qvel[i], data.qacc
        mujoco.mj_inverse(model, inverse)
        needed = inverse.qfrc_inverse.copy()
        for body in (base, ball):
            force = np.zeros(nv)
            wrench = data.xfrc_applied[body]
            mujoco.mj_applyFT(model, inverse, wrench[:3], wrench[3:], inverse.xipos[body], body, force)
            needed -= force
        scale = 1 + np.abs(applied[i]).max()
        worst_torque = max(worst_torque, np.abs(needed - applied[i]).max() / scale)

        # The drive's law at the recorded speed: full torque to the corner speed, then a line to none at the limit.
        torque, v = needed[dofs], qvel[i][dofs]
        along = np.sign(torque) * v
        allowed = limit * np.clip((1 - along / speed) / (1 - corner), 0, 1)
        worst_law = max(worst_law, ((np.abs(torque) - allowed) / limit)[along < speed].max(initial=0.0))
        worst_law = max(worst_law, (np.abs(torque) / limit)[along >= speed].max(initial=0.0))
        air = -DRAG * np.pi * radius**2 * np.linalg.norm(qvel[i][nv - 6 : nv - 3]) * qvel[i][nv - 6 : nv - 3]
        worst_air = max(worst_air, np.abs(outside[i][1][:3] - air).max(), np.abs(outside[i][1][3:]).max())
    worst_state = max(worst_state, np.abs(data.qpos - qpos[-1]).max(), np.abs(data.qvel - qvel[-1]).max())
    strange = np.delete(np.abs(applied), dofs, axis=1).max()

    checks = [
        ("states, from the first alone", worst_state, STATE_LIMIT),
        ("torques by inverse dynamics, over the largest", worst_torque, TORQUE_LIMIT),
        ("inverse torque beyond the drive's law, share of the limit", worst_law, TORQUE_LIMIT),
        ("forces on base or ball that are no drive's", strange, 0.0),
        ("force of the air on the ball, N", worst_air, 1e-9),
    ]
    print(f"{about['robot']}: {count} steps, {dt.sum():.3f} s")
    for name, value, most in checks:
        print(f"  {'ok  ' if value <= most else 'FAIL'} {name}: {value:.2e} (at most {most:.0e})")
    return 0 if all(value <= most for _, value, most in checks) else 1


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(pathlib.Path(sys.argv[1])))
