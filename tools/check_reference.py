#!/usr/bin/env python3
"""Independent check of a shipped kinodynamic reference: Pinocchio's momentum and inverse dynamics along the motion.

    venv/bin/python tools/check_reference.py references/prestoe/10_03_kinodynamic.json

Reads nothing of Instep but the reference, robots/<robot>/<robot>.xml and the contact points in robot.toml. At every knot
but the first and last two it compares centre of mass and centroidal momentum with those stored, takes accelerations
as differences of the stored speeds, and computes the joint torques and the wrench on the base that the stored contact
forces leave over: (33) of paper 1. Fails when one is beyond its bound.
"""

import json
import pathlib
import sys
import tomllib

import numpy as np
import pinocchio as pin

ROOT = pathlib.Path(__file__).resolve().parent.parent
BOUNDS = {"com": 1e-6, "momentum": 1e-5, "wrench": 0.01, "torque": 0.02}


def check(path):
    reference = json.loads(pathlib.Path(path).read_text())
    folder = ROOT / "robots" / reference["robot"]
    model = pin.buildModelFromMJCF(str(folder / f"{reference['robot']}.xml"))
    model = model[0] if isinstance(model, tuple) else model
    settings = tomllib.loads((folder / "robot.toml").read_text())
    contacts = {c["name"]: c for c in settings["contact"]}
    limits = {j: (g["torque"], g["speed"], g["corner"]) for g in settings["group"] for j in g["joints"]}
    names = reference["joint_names"]
    order = [names.index(name) for name in list(model.names)[2:]]
    data = model.createData()
    weight = pin.computeTotalMass(model) * 9.81
    rate, knots = reference["rate"], reference["knots"]

    def world_speed(k):
        return np.concatenate([k["base_velocity"], k["base_angular_velocity"], np.array(k["joint_velocities"])[order]])

    speeds = np.array([world_speed(k) for k in knots])
    worst = dict.fromkeys(["com", "momentum", "wrench", "torque", "over"], 0.0)
    for i in range(2, len(knots) - 2):
        knot = knots[i]
        w, x, y, z = knot["base_orientation"]
        rotation = pin.Quaternion(w, x, y, z).normalized().toRotationMatrix()
        q = np.concatenate([knot["base_position"], [x, y, z, w], np.array(knot["joints"])[order]])
        # Pinocchio's base speed is in the base's own frame, linear first.
        omega = speeds[i][3:6]
        v = speeds[i].copy()
        v[:3] = rotation.T @ v[:3]
        # Even knots are the spline's nodes, odd ones half-way: three knots of one piece, on which speeds are quadratic.
        if i % 2:
            rates = (speeds[i + 1] - speeds[i - 1]) * rate / 2
        else:
            rates = (4 * speeds[i + 1] - 3 * speeds[i] - speeds[i + 2]) * rate / 2
        a = rates.copy()
        a[:3] = rotation.T @ rates[:3] - np.cross(omega, v[:3])
        momentum = pin.computeCentroidalMomentum(model, data, q, v).vector
        com = pin.centerOfMass(model, data, q)
        pin.forwardKinematics(model, data, q)
        external = pin.StdVec_Force([pin.Force.Zero() for _ in range(model.njoints)])
        for name, force in zip(reference["contact_names"], knot["forces"]):
            frame = model.frames[model.getFrameId(contacts[name]["link"], pin.FrameType.BODY)]
            joint = data.oMi[frame.parentJoint]
            at = pin.SE3(joint.rotation, (joint * frame.placement).act(np.array(contacts[name]["point"])))
            external[frame.parentJoint] += (joint.inverse() * at).act(
                pin.Force(joint.rotation.T @ np.array(force), np.zeros(3))
            )
        tau = pin.rnea(model, data, q, v, a, external)
        stored = np.array(knot["torques"])[order]
        bound = np.array([limits[names[j]][0] for j in order])
        worst["com"] = max(worst["com"], np.abs(com - knot["com"]).max())
        worst["momentum"] = max(worst["momentum"], np.abs(momentum - knot["momentum"]).max())
        worst["wrench"] = max(worst["wrench"], np.abs(tau[:6]).max() / weight)
        worst["torque"] = max(worst["torque"], (np.abs(tau[6:] - stored) / bound).max())
        for j, torque, speed in zip(order, tau[6:], v[6:]):
            most, top, corner = limits[names[j]]
            give = most * min(1.0, max(0.0, 1 - np.sign(torque) * speed / top) / (1 - corner))
            worst["over"] = max(worst["over"], abs(torque) - give)
    print(f"{path}: {len(knots)} knots")
    print(f"  centre of mass {worst['com']:.1e} m, momentum {worst['momentum']:.1e} kg m/s and kg m^2/s")
    print(f"  wrench on the base {worst['wrench']:.4f} m g, torques differ by {worst['torque']:.4f} of their limits")
    print(f"  beyond the drives: {worst['over']:.3f} N m")
    return worst["over"] <= 0 and all(worst[name] <= bound for name, bound in BOUNDS.items())


if __name__ == "__main__":
    sys.exit(0 if all([check(path) for path in sys.argv[1:]]) else 1)
