#!/usr/bin/env python3
"""Does a recorded kick again in MuJoCo's own Python, independently of Instep's world and of its drives.

    cargo run -- kick --steps out/steps
    cargo run -- kick --engine dynamic --robot nao --ball 0.17,-0.05 --speed 0.7 --steps out/steps
    pip install mujoco==3.17.0
    python3 tools/replay.py out/steps

1. Forward. From the first state alone it steps through the whole kick with the recorded torques, pushes and air, and
   compares every state with the recorded one.
2. The drives' law, written down again here: from nothing but the commands that the controller offered it works out
   what of them reaches the drives and when (bus period, delay; angles alone for a position servo), and which torque
   comes out (PID or PD, dead zone, torque-speed line, sag of the supply, play of the gears). Those are the torques.
3. Inverse. Which torques must the motors have given, by position, speed and acceleration alone? Those recorded, and
   nowhere more than torque limit and torque-speed line allow. The world's contact solver stops at a tolerance of
   1e-10, and what it leaves over in stiff contacts would stand in the torques; so each step's acceleration is solved
   for again, to the end. What the world's own accelerations leave is told beside it, with a limit of its own.
4. Air: 1/2 rho c A v^2 on the ball. Nothing else touches the world from outside but a push on the base.

Relative errors are those of a state or torque over 1 or over the largest of its kind. Exit code 1 if a check fails.
"""

import json
import pathlib
import sys

import mujoco
import numpy as np

LIMIT = 1e-6
SOLVER_LIMIT = 2e-4  # what the solver leaves at most where a foot squeezes a stiff ball onto the ground
GRACE = 1e-7  # times are sums of steps: a command that is this much early is on time
AIR = 1.204  # kg/m^3


class Drives:
    """The drives of a robot: what of the commands offered to them acts, and the torque of each step."""

    def __init__(self, about, model_dofs):
        get = lambda key: np.array(about[key], dtype=float)
        self.built = about["drives"] == "as_built"
        self.servo = about["kind"] == "position_servo"
        self.period, self.delay, self.sag = about["period"], about["delay"], about["sag"]
        self.limit, self.speed, self.corner = get("torque"), get("speed"), get("corner")
        self.kp, self.kd, self.p, self.i, self.d = (get(key) for key in ("kp", "kd", "p", "i", "d"))
        self.dead_zone, self.play, self.offsets = get("dead_zone"), get("play"), get("encoder_offsets")
        self.stall = self.limit / (1 - self.corner)
        self.slope = self.stall / self.speed
        n = len(self.limit)
        self.gap, self.integral, self.load = np.zeros(n), np.zeros(n), 0.0
        self.active, self.coming, self.next = np.zeros((3, n)), [], None

    def offer(self, time, command):
        if not self.built:
            self.active = command
            return
        taken = command * np.array([[1], [0], [0]]) if self.servo else command
        if self.next is None:
            self.active, self.next = taken, time + self.period
        elif time + GRACE >= self.next:
            self.coming.append((time + self.delay, taken))
            self.next += self.period
            if self.next <= time + GRACE:
                self.next = time + self.period
        while self.coming and self.coming[0][0] <= time + GRACE:
            self.active = self.coming.pop(0)[1]

    def most(self, along, voltage, per_torque):
        """What the motor gives at most along a direction in which the joint moves with `along`."""
        line = self.slope * (voltage * self.speed - along) / (1 + self.slope * per_torque)
        return np.clip(line, -self.limit, self.limit)

    def torque(self, q, v, dt, inverse_inertia):
        position, velocity, torque = self.active
        per_torque = dt * inverse_inertia
        if not self.built:
            wanted = self.kp * (position - q) + self.kd * (velocity - v) + torque
            return np.clip(wanted, -self.most(-v, 1.0, per_torque), self.most(v, 1.0, per_torque))
        voltage = 1 - self.sag * self.load
        error = position - (q + self.offsets)
        error -= np.clip(error, -self.dead_zone, self.dead_zone)
        if self.servo:
            self.integral = np.clip(self.integral + self.i * error * dt, -self.stall, self.stall)
            held, damping = self.p * error + self.integral, self.d + self.slope
            free = (held - damping * v) / (1 + damping * per_torque)
            share = (held - self.d * (v + free * per_torque)) / self.stall
            full = (np.copysign(voltage, share) * self.stall - self.slope * v) / (1 + self.slope * per_torque)
            given = np.clip(np.where(np.abs(share) <= voltage, free, full), -self.limit, self.limit)
        else:
            wanted = self.kp * error + self.kd * (velocity - v) + torque
            given = np.clip(wanted, -self.most(-v, voltage, per_torque), self.most(v, voltage, per_torque))
        half = 0.5 * self.play
        self.gap = np.clip(self.gap + given / self.slope * dt, -half, half)
        carries = np.where(given > 0, self.gap >= half, self.gap <= -half) | (self.play <= 0)
        given = np.where(carries, given, 0.0)
        self.load = min(np.abs(given).sum() / self.limit.sum(), 1.0)
        return given


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
    names = about["joints"]
    dofs = np.array([model.joint(name).dofadr[0] for name in names])
    places = np.array([model.joint(name).qposadr[0] for name in names])
    limit, speed, corner = (np.array(about[key]) for key in ("torque", "speed", "corner"))
    commands = np.fromfile(folder / "commands.f64", dtype="<f8").reshape(-1, 1 + 3 * len(names))
    drives = Drives(about, dofs)

    # Forward, from the first state alone. A jump of the ball between two steps is a hand's, and taken over.
    data.qpos[:], data.qvel[:] = qpos[0], qvel[0]
    mujoco.mj_forward(model, data)
    worst = dict.fromkeys(("state", "drive", "inverse", "solver", "law", "air"), 0.0)

    def note(name, value):
        worst[name] = max(worst[name], float(value))

    state_error = lambda found, told: (np.abs(found - told) / np.maximum(1, np.abs(told))).max()
    solver = (model.opt.tolerance, model.opt.ls_tolerance, model.opt.iterations)
    again, inverse = mujoco.MjData(model), mujoco.MjData(model)
    free = slice(nq - 7, nq)
    time, offered = 0.0, 0
    for i in range(count):
        if np.abs(data.qpos[free] - qpos[i][free]).max() > 1e-3:
            data.qpos[free], data.qvel[nv - 6 :] = qpos[i][free], qvel[i][nv - 6 :]
            mujoco.mj_forward(model, data)
        note("state", max(state_error(data.qpos, qpos[i]), state_error(data.qvel, qvel[i])))

        while offered < len(commands) and commands[offered, 0] <= time + GRACE:
            drives.offer(commands[offered, 0], commands[offered, 1:].reshape(3, -1))
            offered += 1
        given = drives.torque(qpos[i][places], qvel[i][dofs], dt[i], data.qLDiagInv[dofs])
        note("drive", (np.abs(given - applied[i][dofs]) / limit).max())

        model.opt.timestep = dt[i]
        for world in (data, again):
            world.qfrc_applied[:] = applied[i]
            world.xfrc_applied[:] = 0
            world.xfrc_applied[base], world.xfrc_applied[ball] = outside[i]
        again.qpos[:], again.qvel[:], again.qacc_warmstart[:] = data.qpos, data.qvel, data.qacc_warmstart
        mujoco.mj_step(model, data)
        time += dt[i]

        # Inverse: what forces does this acceleration need? Those that are not contact, friction or passive are applied.
        model.opt.tolerance, model.opt.ls_tolerance, model.opt.iterations = 0, 1e-10, 1000
        mujoco.mj_forward(model, again)
        model.opt.tolerance, model.opt.ls_tolerance, model.opt.iterations = solver
        for name, acceleration in (("solver", data.qacc), ("inverse", again.qacc)):
            inverse.qpos[:], inverse.qvel[:], inverse.qacc[:] = qpos[i], qvel[i], acceleration
            mujoco.mj_inverse(model, inverse)
            needed = inverse.qfrc_inverse.copy()
            for body in (base, ball):
                force = np.zeros(nv)
                wrench = data.xfrc_applied[body]
                mujoco.mj_applyFT(model, inverse, wrench[:3], wrench[3:], inverse.xipos[body], body, force)
                needed -= force
            note(name, (np.abs(needed - applied[i])[dofs] / limit).max())

        # Full torque to the corner speed, then a line to none at the limit.
        torque, v = needed[dofs], qvel[i][dofs]
        along = np.sign(torque) * v
        allowed = limit * np.clip((1 - along / speed) / (1 - corner), 0, 1)
        note("law", ((np.abs(torque) - allowed) / limit).max())
        velocity = qvel[i][nv - 6 : nv - 3]
        air = -0.5 * AIR * about["drag"] * np.pi * radius**2 * np.linalg.norm(velocity) * velocity
        note("air", max(np.abs(outside[i][1][:3] - air).max(), np.abs(outside[i][1][3:]).max()))
    note("state", max(state_error(data.qpos, qpos[-1]), state_error(data.qvel, qvel[-1])))
    strange = np.delete(np.abs(applied), dofs, axis=1).max()

    checks = [
        ("states, from the first alone", worst["state"], LIMIT),
        ("torques by the drives' law from the commands, share of the limit", worst["drive"], LIMIT),
        ("torques by inverse dynamics, share of the limit", worst["inverse"], LIMIT),
        ("the same by the world's own accelerations", worst["solver"], SOLVER_LIMIT),
        ("inverse torque beyond torque limit or line, share of the limit", worst["law"], LIMIT),
        ("forces on base or ball that are no drive's", strange, 0.0),
        ("force of the air on the ball, N", worst["air"], 1e-9),
    ]
    print(f"{about['robot']}, {about['kind']}, drives {about['drives']}: {count} steps, {dt.sum():.3f} s")
    for name, value, most in checks:
        print(f"  {'ok  ' if value <= most else 'FAIL'} {name}: {value:.2e} (at most {most:.0e})")
    return 0 if all(value <= most for _, value, most in checks) else 1


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(pathlib.Path(sys.argv[1])))
