"""`python -m fitmac.demo`: a toy world, with and without FIT-MAC."""

from __future__ import annotations

import argparse
import sys

import fitmac
from fitmac.toy import ToyEnv, ToyPolicy

_OFF = {"switches": {"target_corrector": False, "execution_corrector": False,
                     "hard_pick": False, "hard_place": False}}
_POLICIES = {
    "competent": ToyPolicy(),
    "takes the wrong can": ToyPolicy(target="soup"),
    "stops above the can": ToyPolicy(stall_m=0.05),
}


def episode(policy: ToyPolicy, seed: int, config: fitmac.Config) -> fitmac.Run:
    """One episode of the toy."""
    task = fitmac.Task(target="can", destination="plate", prompt="put the can on the plate")
    loop = fitmac.wrap(policy, ToyEnv(), poses=lambda env, _: env.poses(), task=task, config=config)
    return loop.run(max_steps=600, seed=seed)


def main() -> int:
    """Prints the table; 0 if FIT-MAC saved what failed and harmed nothing."""
    parser = argparse.ArgumentParser(prog="python -m fitmac.demo", description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="episodes a row (3)")
    seeds = parser.parse_args().seeds
    if seeds < 1:
        parser.error(f"--seeds is {seeds}, at least 1 is needed")
    print(f"{'policy':<22}{'alone':>8}{'with FIT-MAC':>14}{'steps taken over':>18}")
    good = True
    for name, policy in _POLICIES.items():
        alone = [episode(policy, s, fitmac.Config(settings=_OFF)) for s in range(seeds)]
        watched = [episode(policy, s, fitmac.Config()) for s in range(seeds)]
        a, w = (sum(run.success for run in runs) for runs in (alone, watched))
        taken = sum(run.interventions() for run in watched) / seeds
        print(f"{name:<22}{f'{a}/{seeds}':>8}{f'{w}/{seeds}':>14}{taken:>18.1f}")
        good = good and w >= a and w == seeds
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
