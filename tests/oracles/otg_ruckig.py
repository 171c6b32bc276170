"""Durations by Ruckig for the problems on standard input.

In: 64-bit floats; a problem is the number of axes n, then position, velocity, acceleration, target
position, target velocity, velocity, acceleration and jerk limit, each n numbers.
Out: 64-bit floats; the duration of each problem in seconds, NaN where Ruckig gives none.
"""
import sys

import numpy as np
import ruckig


def main():
    data = np.frombuffer(sys.stdin.buffer.read(), dtype="<f8")
    solvers = {}
    durations = []
    at = 0
    while at < len(data):
        n = int(data[at])
        rows = data[at + 1 : at + 1 + 8 * n].reshape(8, n).tolist()
        at += 1 + 8 * n
        if n not in solvers:
            solvers[n] = (ruckig.Ruckig(n), ruckig.InputParameter(n), ruckig.Trajectory(n))
        solver, problem, trajectory = solvers[n]
        (
            problem.current_position,
            problem.current_velocity,
            problem.current_acceleration,
            problem.target_position,
            problem.target_velocity,
            problem.max_velocity,
            problem.max_acceleration,
            problem.max_jerk,
        ) = rows
        result = solver.calculate(problem, trajectory)
        worked = result in (ruckig.Result.Working, ruckig.Result.Finished)
        durations.append(trajectory.duration if worked else float("nan"))
    sys.stdout.buffer.write(np.array(durations, dtype="<f8").tobytes())


if __name__ == "__main__":
    main()
