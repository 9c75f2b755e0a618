"""Any invalid argument gives a one-sentence error and leaves the running world unchanged."""

import inspect
from collections.abc import Callable
from operator import attrgetter

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kbot.sim import Simulation
from kbot.sim import injected_faults as faults
from kbot.sim.disturbances import Disturbances
from kbot.sim.models import Models
from kbot.sim.robot import SimulatedRobot
from kbot.sim.robots import Robots
from kbot.sim.snapshots import Snapshots
from kbot.sim.stepping import Stepping
from kbot.text import KbotError

HOSTILE = [
    None, "", "a", "base_lnk", -1, 3, 10**400, True, float("nan"), float("inf"), -1e308, 1e308, 1j, b"x",
    object(), (), (1.0,), (1.0, 2.0), (0.0, float("nan"), 0.0), (1e308, 0.0, 0.0), ("a", "b", "c"),
    [[1.0], [2.0], [3.0]], {}, {"a": 1}, {"left_wheel_joint": float("nan")}, {"left_wheel_joint": 1e308},
    np.zeros((3, 3)), np.array([]), np.array([1.0, 2.0, 3.0]), np.float64("nan"),
]  # fmt: skip
PARTS = {
    "": Simulation, "models.": Models, "disturbances.": Disturbances, "snapshots.": Snapshots,
    "stepping.": Stepping, "robots.": Robots, "robots.first.": SimulatedRobot,
}  # fmt: skip
BETWEEN_PARTS = {
    "models.continue_from", "models.use", "disturbances.forget", "disturbances.shift_time", "stepping.jump",
    "robots.add", "robots.publish", "robots.remove", "robots.tick", "robots.first.advance",
    "robots.first.restore", "robots.first.shift_time", "robots.first.stand_at", "robots.first.take_over",
    "robots.first.tick",
}  # fmt: skip
"""Methods that other parts of a simulation call, but users do not."""
METHODS = [
    part + name
    for part, kind in PARTS.items()
    for name, value in inspect.getmembers(kind, inspect.isfunction)
    if not name.startswith("_")
    and part + name not in BETWEEN_PARTS
    and name not in ("get", "items", "keys", "values")
    and len(inspect.signature(value).parameters) > 1
]
GOOD = {
    "link": "base_link", "force": (1.0, 0.0, 0.0), "duration": 0.1, "torque": (0.0, 0.0, 0.1), "to": "crate",
    "x": 0.1, "y": 0.2, "yaw": 0.3, "joint": "left_wheel_joint", "at": 1e6, "name": "b", "model": "kbot",
    "linear": 0.1, "angular": 0.1, "seconds": 0.01, "n": 1, "position": 0.1,
}  # fmt: skip
QUIET = settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def everything(sim: Simulation) -> tuple[object, ...]:
    """Everything that determines how the run continues, including the engine's model."""
    state = sim.state()
    model, _ = sim.engine.current()
    arrays = [getattr(model, name) for name in ("body_mass", "geom_friction", "actuator_gainprm", "qpos0")]
    parts = (state.vector, *arrays)
    values = (state.steps, state.robots, state.pushes, state.welds, state.random, sim.time, sim.paused)
    return (
        *(part.tobytes() for part in parts),
        values,
        list(sim.robots),
        sim.commands.lost_share,
        sim.robots.first.twist,
    )


def is_refused(call: Callable[[], object]) -> bool:
    """Whether the call raises a KbotError. Any other error fails the test."""
    try:
        call()
    except KbotError as error:
        return bool(str(error).strip())
    return False


@pytest.fixture(scope="module")
def running(kbot_robot) -> Simulation:
    sim = Simulation(kbot_robot, world="boxes")
    sim.cmd_vel(0.2, 0.3)
    sim.run(0.11)
    return sim


@QUIET
@given(data=st.data())
def test_method_succeeds_or_raises_without_side_effects(running, data):
    name = data.draw(st.sampled_from(METHODS))
    method = attrgetter(name)(running)
    parameters = list(inspect.signature(method).parameters.values())
    given_ = {}
    for parameter in parameters:
        choices = [st.sampled_from(HOSTILE)]
        if parameter.name in GOOD:
            choices.append(st.just(GOOD[parameter.name]))
        if parameter.default is parameter.empty or data.draw(st.booleans()):
            given_[parameter.name] = data.draw(st.one_of(choices))
    saved, before = running.state(), everything(running)
    bodies = {body.name for body in running.world.bodies}
    if is_refused(lambda: method(**given_)):
        assert everything(running) == before
    else:
        running.step(3)
        assert np.isfinite(running.state().vector).all()
        things = [body.name for body in running.world.bodies if body.name not in bodies]
        for model in [*list(running.robots)[1:], *things]:
            running.models.delete_model(model)
        running.restore(saved)


FAULTS = list(faults.FAULTS.values())


@QUIET
@given(data=st.data())
def test_fault_of_any_value_is_rejected_or_acts(running, data):
    kind = data.draw(st.sampled_from(FAULTS))
    values = [data.draw(st.sampled_from(HOSTILE)) for _ in inspect.signature(kind).parameters]
    at = data.draw(st.sampled_from([*HOSTILE, 1e6]))
    before = everything(running)
    is_refused(lambda: running.disturbances.schedule(kind(*values), at))
    assert everything(running) == before


@pytest.mark.parametrize("what", ["robot", "world", "seed", "timestep", "contacts", "limits", "start"])
@pytest.mark.parametrize("value", HOSTILE, ids="{!r:.12}".format)
def test_simulation_of_any_arguments_is_created_or_rejected(kbot_robot, what, value):
    is_refused(lambda: Simulation(**{"robot": kbot_robot, what: value}).step())
