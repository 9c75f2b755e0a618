"""A peer with Cyclone DDS, as CYCLONEDDS_URI configures it. It prints the topics that others publish."""

import json
import sys
import time

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.domain import DomainParticipant


def main(domain: int, seconds: float) -> None:
    participant = DomainParticipant(domain)
    publications = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
    topics: set[str] = set()
    end = time.monotonic() + seconds
    while time.monotonic() < end and "rt/odom" not in topics:
        topics |= {found.topic_name for found in publications.take(100)}
        time.sleep(0.05)
    sys.stdout.write(json.dumps(sorted(topics)))


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
