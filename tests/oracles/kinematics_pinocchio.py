"""Forward kinematics by Pinocchio.

locate                            prints the folder of example-robot-data's robots
joints URDF BASE TIP              prints the names of the joints that move TIP against BASE
evaluate URDF BASE TIP            standard input: 64-bit floats, per sample n coordinates and n
                                  velocities of these joints; standard output: 64-bit floats, per
                                  sample the rotation (9, row-major), the position (3), the
                                  Jacobian in base axes (6 n, row-major), the one in tip axes (6 n)
                                  and the bias acceleration in base axes (6). All against BASE.
"""
import pathlib
import sys

import numpy as np
import pinocchio as pin


def robots():
    site = pathlib.Path(pin.__file__).resolve()
    for parent in site.parents:
        for candidate in (
            parent / "share/example-robot-data/robots",
            parent / "cmeel.prefix/share/example-robot-data/robots",
        ):
            if candidate.is_dir():
                return candidate
    sys.exit("example-robot-data is not installed: run cargo xtask test")


def load(urdf, base, tip):
    model = pin.buildModelFromUrdf(urdf)
    base_frame = model.getFrameId(base, pin.FrameType.BODY)
    tip_frame = model.getFrameId(tip, pin.FrameType.BODY)

    def ancestors(frame):
        return list(model.supports[model.frames[frame].parentJoint])

    above = set(ancestors(base_frame))
    moving = [j for j in ancestors(tip_frame) if j not in above]
    return model, base_frame, tip_frame, moving


def evaluate(urdf, base, tip):
    model, base_frame, tip_frame, moving = load(urdf, base, tip)
    data = model.createData()
    columns = [model.idx_vs[j] for j in moving]
    n = len(columns)
    samples = np.frombuffer(sys.stdin.buffer.read(), dtype="<f8").reshape(-1, 2 * n)
    neutral = pin.neutral(model)
    zero = np.zeros(model.nv)
    tangent, velocity = np.zeros(model.nv), np.zeros(model.nv)
    out = np.empty((len(samples), 9 + 3 + 12 * n + 6))
    for row, sample in zip(out, samples):
        tangent[columns], velocity[columns] = sample[:n], sample[n:]
        q = pin.integrate(model, neutral, tangent)
        pin.forwardKinematics(model, data, q, velocity, zero)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        home, there = data.oMf[base_frame], data.oMf[tip_frame]
        relative = home.actInv(there)
        back = home.rotation.T
        aligned = pin.getFrameJacobian(model, data, tip_frame, pin.LOCAL_WORLD_ALIGNED)[:, columns]
        local = pin.getFrameJacobian(model, data, tip_frame, pin.LOCAL)[:, columns]
        bias = pin.getFrameClassicalAcceleration(
            model, data, tip_frame, pin.LOCAL_WORLD_ALIGNED
        )
        row[:] = np.concatenate(
            [
                relative.rotation.ravel(),
                relative.translation,
                (back @ aligned[:3]).ravel(),
                (back @ aligned[3:]).ravel(),
                local.ravel(),
                back @ bias.linear,
                back @ bias.angular,
            ]
        )
    sys.stdout.buffer.write(out.astype("<f8").tobytes())


def main():
    command, *arguments = sys.argv[1:]
    if command == "locate":
        print(robots())
    elif command == "joints":
        model, _, _, moving = load(*arguments)
        print("\n".join(model.names[j] for j in moving))
    elif command == "evaluate":
        evaluate(*arguments)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
