#!/usr/bin/python3
"""Prints the transforms that ROS publishes for given joint positions, as JSON. Runs in the machine's Python.

Arguments: a JSON list of {joint: position}, and a JSON list of the links that move. Publishes each entry on
/joint_states until the transforms of the moving links arrive with one of its stamps. Other publishers of
joint states use other stamps. Prints {child: [parent, [x, y, z], [x, y, z, w]]} for each entry.
"""

import json
import sys
import time
from collections import defaultdict

import rospy
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

by_stamp = defaultdict(dict)
fixed = {}


def edges(message):
    for item in message.transforms:
        t, q = item.transform.translation, item.transform.rotation
        value = [item.header.frame_id, [t.x, t.y, t.z], [q.x, q.y, q.z, q.w]]
        yield item.header.stamp.to_nsec(), item.child_frame_id, value


def on_transforms(message):
    for stamp, child, value in edges(message):
        by_stamp[stamp][child] = value


def on_static_transforms(message):
    fixed.update({child: value for _, child, value in edges(message)})


def transforms(joints, movable, publisher):
    """The transforms that arrive for one set of joint positions."""
    sent = []
    end = time.monotonic() + 60
    while time.monotonic() < end:
        message = JointState(name=list(joints), position=list(joints.values()))
        message.header.stamp = rospy.Time.now()
        sent.append(message.header.stamp.to_nsec())
        publisher.publish(message)
        time.sleep(0.1)
        for stamp in sent:
            if set(movable) <= set(by_stamp[stamp]):
                return {**fixed, **by_stamp[stamp]}
    return sys.exit(f"no transforms for {joints}; static ones are {sorted(fixed)}")


def main():
    positions, movable = json.loads(sys.argv[1]), json.loads(sys.argv[2])
    rospy.init_node("listen", anonymous=True)
    rospy.Subscriber("/tf", TFMessage, on_transforms)
    rospy.Subscriber("/tf_static", TFMessage, on_static_transforms)
    publisher = rospy.Publisher("/joint_states", JointState, queue_size=10)
    json.dump([transforms(joints, movable, publisher) for joints in positions], sys.stdout)


main()
