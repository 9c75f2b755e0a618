"""Runs a small sweep on a Ray cluster: `ray_run.py ADDRESS DIR`. Prints a dot for each run."""

import sys
from pathlib import Path

from kbot.sweep.cluster import RayCluster, parse_place
from kbot.sweep.journal import Journal
from kbot.sweep.plan import Plan
from kbot.sweep.preparation import Request, prepare
from kbot.sweep.runner import Sweep
from kbot.trials.pool import Pool

REQUEST = Request(
    robot="r.xacro",
    dimensions=["radius=0.03:0.045:4", "seed=0,1,2"],
    scenarios=["drive.scenario.yaml"],
    objectives=["energy"],
)


def plan_of(request: Request = REQUEST) -> Plan:
    with Pool(1) as pool:
        return prepare(request, pool)


def dot() -> None:
    sys.stdout.write(".")
    sys.stdout.flush()


def main(address: str, out: str) -> None:
    plan = plan_of()
    folder = Path(out)
    folder.mkdir()
    with (
        Journal(folder / "runs.jsonl", plan) as journal,
        RayCluster(parse_place(address), versions=plan.versions, not_sent=[out]) as cluster,
    ):
        Sweep(plan, journal, folder).run(cluster, dot)


if __name__ == "__main__":
    main(*sys.argv[1:])
