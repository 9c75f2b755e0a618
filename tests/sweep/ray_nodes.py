"""Runs a Ray cluster of three nodes on this machine. Prints its addresses, and reads commands.

`kill` kills the processes of a node. The end of the input ends the cluster.
"""

import logging
import sys
from typing import Any

from ray.cluster_utils import Cluster

STORE_BYTES = 80_000_000


def write(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main(client_port: int) -> None:
    logging.disable(logging.CRITICAL)
    options: dict[str, Any] = {"num_cpus": 1, "object_store_memory": STORE_BYTES, "include_dashboard": False}
    head = {**options, "ray_client_server_port": client_port} if client_port else options
    cluster = Cluster(initialize_head=True, head_node_args=head)
    nodes = [cluster.add_node(**options) for _ in range(2)]
    cluster.wait_for_nodes()
    write(cluster.address)
    for line in sys.stdin:
        if line.strip() == "kill":
            cluster.remove_node(nodes.pop(), allow_graceful=False)
            write("killed")
    cluster.shutdown()


if __name__ == "__main__":
    main(int(sys.argv[1]))
