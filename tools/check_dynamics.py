#!/usr/bin/env python3
"""Independent oracle for instep-robot: Pinocchio computes the same quantities from the same MJCF.

Needs Pinocchio 3 or later (`pip install pin`), in a virtual environment of your own:

    python3 -m venv venv && venv/bin/pip install pin
    venv/bin/python tools/check_dynamics.py            # every robot
    venv/bin/python tools/check_dynamics.py nao        # one

For seeded random states it writes crates/instep-robot/tests/data/<robot>_pinocchio.json, which the test `oracle`
of instep-robot compares with our own numbers. Everything in the file is in Pinocchio's conventions: quaternion
x, y, z, w; base velocity and acceleration in the base's own frame, linear first; momentum in world axes at the centre
of mass, linear first. The Rust test converts, so that the conversion is tested too.

What is Pinocchio's and what is ours: Pinocchio reads the MJCF by its own parser and runs its own algorithms; this
script draws the states and picks the links and points.
"""

import json
import pathlib
import sys

import numpy as np
import pinocchio as pin

ROOT = pathlib.Path(__file__).resolve().parent.parent
STATES = 8
# Links whose pose and Jacobian are written, and the links on which contact forces act.
LINKS = {
    "prestoe": (["left_foot", "right_toe", "torso", "right_hand"], ["left_toe", "right_foot", "left_hand"]),
    "nao": (["l_ankle", "RTibia", "Head", "r_wrist"], ["l_ankle", "r_ankle", "l_wrist"]),
    "wolfgang": (["l_foot", "r_lower_leg", "head", "r_lower_arm"], ["l_foot", "r_foot", "l_lower_arm"]),
}


def floats(array):
    """Plain list; Python prints each number so that it reads back bit by bit."""
    return [float(x) for x in np.asarray(array).flatten()]


def load(path):
    model = pin.buildModelFromMJCF(str(path))
    return model[0] if isinstance(model, tuple) else model


def body_frame(model, link):
    return model.frames[model.getFrameId(link, pin.FrameType.BODY)]


def state(model, rng, links, loaded):
    """One random state with everything that the Rust test compares."""
    data = model.createData()
    quaternion = rng.normal(size=4)
    q = np.concatenate(
        [
            rng.uniform(-1.0, 1.0, 3),
            quaternion / np.linalg.norm(quaternion),
            rng.uniform(-1.5, 1.5, model.nq - 7),  # joint ranges are no part of the comparison
        ]
    )
    v = rng.uniform(-3.0, 3.0, model.nv)
    a = rng.uniform(-20.0, 20.0, model.nv)

    pin.forwardKinematics(model, data, q, v, a)
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    out = {"q": floats(q), "v": floats(v), "a": floats(a), "links": [], "forces": []}

    for link in links:
        frame = body_frame(model, link)
        point = rng.uniform(-0.1, 0.1, 3)
        placement = data.oMi[frame.parentJoint] * frame.placement
        # Velocity of the point: the joint's spatial Jacobian in the world, moved to the point.
        world = placement.act(point)
        spatial = pin.getJointJacobian(model, data, frame.parentJoint, pin.ReferenceFrame.WORLD)
        jacobian = spatial[:3] - pin.skew(world) @ spatial[3:]
        out["links"].append(
            {
                "link": link,
                "position": floats(placement.translation),
                "rotation": floats(placement.rotation),
                "point": floats(point),
                "jacobian": floats(jacobian),
            }
        )

    out["com"] = floats(pin.centerOfMass(model, data, q))
    out["com_jacobian"] = floats(pin.jacobianCenterOfMass(model, data, q))
    out["momentum_matrix"] = floats(pin.computeCentroidalMap(model, data, q))
    out["momentum"] = floats(pin.computeCentroidalMomentum(model, data, q, v).vector)
    pin.forwardKinematics(model, data, q, v)
    # Summed here: computeKineticEnergy of Pinocchio 4.1.0 leaves the rotors of joints with a skew or negative axis out.
    energy = sum(inertia.vtiv(twist) for inertia, twist in zip(model.inertias, data.v)) + model.armature @ (v * v)
    out["kinetic_energy"] = float(0.5 * energy)
    mass = pin.crba(model, data, q)
    out["mass_matrix_upper"] = floats(mass[np.triu_indices(model.nv)])

    external = pin.StdVec_Force([pin.Force.Zero() for _ in range(model.njoints)])
    for link in loaded:
        frame = body_frame(model, link)
        joint = data.oMi[frame.parentJoint]
        point = rng.uniform(-0.1, 0.1, 3)
        force = rng.uniform(-200.0, 200.0, 3)
        at = pin.SE3(joint.rotation, (joint * frame.placement).act(point))
        local = pin.Force(joint.rotation.T @ force, np.zeros(3))
        external[frame.parentJoint] += (joint.inverse() * at).act(local)
        out["forces"].append({"link": link, "point": floats(point), "force": floats(force)})
    out["inverse_dynamics"] = floats(pin.rnea(model, data, q, v, a, external))
    return out


def write(robot):
    model = load(ROOT / "robots" / robot / f"{robot}.xml")
    rng = np.random.default_rng(20240714)
    links, loaded = LINKS[robot]
    result = {
        "robot": robot,
        "pinocchio": pin.__version__,
        "joints": list(model.names)[2:],
        "mass": float(pin.computeTotalMass(model)),
        "states": [state(model, rng, links, loaded) for _ in range(STATES)],
    }
    path = ROOT / "crates" / "instep-robot" / "tests" / "data" / f"{robot}_pinocchio.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(result) + "\n")
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size} bytes, {len(result['joints'])} joints, {result['mass']} kg")


if __name__ == "__main__":
    for name in sys.argv[1:] or LINKS:
        write(name)
