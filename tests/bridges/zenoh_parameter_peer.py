"""A client of zenoh-ros2-sdk that reads and sets the parameters of a node, as `ros2 param` does.

It prints the results as JSON. Arguments: the router's port, and the hash of each service's type as JSON.
"""

import json
import sys
import time

import numpy as np
from zenoh_ros2_sdk import ROS2ServiceClient, ROS2Subscriber
from zenoh_ros2_sdk.discovery import get_service_info, get_service_names_and_types

from kbot.record.encodings.types import ros2_definition

port, hashes = int(sys.argv[1]), json.loads(sys.argv[2])
place = {"router_ip": "127.0.0.1", "router_port": port}
opened = []


def with_part(field: str, part: str) -> str:
    """A definition, followed by the definition of its nested type."""
    return f"{field}\n{'=' * 80}\nMSG: {part}\n{ros2_definition(part.replace('/', '/msg/'))[0]}"


def client(kind: str, request: str, response: str) -> ROS2ServiceClient:
    name = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in kind).lstrip("_")
    # the library computes the hashes of types without nested types
    digest = hashes[kind] if "rcl_interfaces" in request + response else None
    made = ROS2ServiceClient(
        f"/kbot/{name}", f"rcl_interfaces/srv/{kind}", request, response, type_hash=digest, **place
    )
    opened.append(made)
    return made


parameters = with_part("rcl_interfaces/Parameter[] parameters", "rcl_interfaces/Parameter")
results = with_part("rcl_interfaces/SetParametersResult[] results", "rcl_interfaces/SetParametersResult")
result = with_part("rcl_interfaces/SetParametersResult result", "rcl_interfaces/SetParametersResult")
values = with_part("rcl_interfaces/ParameterValue[] values", "rcl_interfaces/ParameterValue")
listed = with_part("rcl_interfaces/ListParametersResult result", "rcl_interfaces/ListParametersResult")
described = with_part(
    "rcl_interfaces/ParameterDescriptor[] descriptors", "rcl_interfaces/ParameterDescriptor"
)

get = client("GetParameters", "string[] names", values)
types = client("GetParameterTypes", "string[] names", "uint8[] types")
list_ = client("ListParameters", "string[] prefixes\nuint64 depth", listed)
describe = client("DescribeParameters", "string[] names", described)
set_ = client("SetParameters", parameters, results)
set_together = client("SetParametersAtomically", parameters, result)

known = get.session_mgr.store.types
Parameter, Value = known["rcl_interfaces/msg/Parameter"], known["rcl_interfaces/msg/ParameterValue"]
ONE, MANY = ("bool", "integer", "double", "string"), ("byte", "bool", "integer", "double", "string")
FIELDS = [f"{kind}_value" for kind in ONE] + [f"{kind}_array_value" for kind in MANY]
empty = dict(zip(FIELDS, (False, 0, 0.0, "", [], [], [], [], []), strict=True))


def parameter(name: str, kind: int, value: object = None) -> object:
    fields = dict(empty)
    if kind:
        fields[FIELDS[kind - 1]] = value
    for field, dtype in (("byte", "int8"), ("bool", "bool"), ("integer", "int64"), ("double", "float64")):
        fields[f"{field}_array_value"] = np.array(fields[f"{field}_array_value"], dtype)
    return Parameter(name=name, value=Value(type=kind, **fields))


def plain(value: object) -> object:
    found = None if value.type == 0 else getattr(value, FIELDS[value.type - 1])
    return found.tolist() if hasattr(found, "tolist") else found


def result_of(response: object) -> list[object]:
    return [response.successful, response.reason]


events = []
EVENT = "rcl_interfaces/msg/ParameterEvent"
listener = ROS2Subscriber(
    "/parameter_events",
    EVENT,
    events.append,
    msg_definition=ros2_definition(EVENT)[0],
    type_hash=hashes["ParameterEvent"],
    **place,
)
opened.append(listener)
NAMES = ["use_sim_time", "robot_description", "arm.gain", "none", "texts", "numbers"]
found = {
    "get": [plain(value) for value in get.call(names=NAMES).values],
    "types": types.call(names=NAMES).types.tolist(),
    "list": list_.call(prefixes=[], depth=0).result.names,
    "shallow": list_.call(prefixes=[], depth=1).result.names,
    "arm": list_.call(prefixes=["arm"], depth=0).result.names,
    "folders": list_.call(prefixes=[], depth=0).result.prefixes,
    "describe": [[d.name, d.type, d.dynamic_typing] for d in describe.call(names=["arm.gain"]).descriptors],
    "set": [
        result_of(result)
        for result in set_.call(
            parameters=[
                parameter("arm.gain", 3, 2.5),
                parameter("new.one", 7, [1, -2]),
                parameter("bytes", 5, [1]),
                parameter("numbers", 0),
            ]
        ).results
    ],
    "invalid together": result_of(
        set_together.call(parameters=[parameter("arm.gain", 3, 9.0), parameter("", 1, True)]).result
    ),
    "set together": result_of(
        set_together.call(parameters=[parameter("first", 1, True), parameter("second", 9, ["b"])]).result
    ),
    "afterwards": list_.call(prefixes=[], depth=0).result.names,
    "services": [name for name, _ in get_service_names_and_types(router_port=port)],
    "info": get_service_info("/kbot/list_parameters", router_port=port).service_types,
}
end = time.monotonic() + 60
while time.monotonic() < end and not any(p.name == "second" for e in events for p in e.new_parameters):
    time.sleep(0.05)
for kind in ("new", "changed", "deleted"):
    found[kind] = {p.name: plain(p.value) for e in events for p in getattr(e, f"{kind}_parameters")}
found["nodes"] = sorted({event.node for event in events})
sys.stdout.write(json.dumps(found))
for entity in opened:
    entity.close()
get.session_mgr.session.close()
