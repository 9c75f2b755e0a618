#!/usr/bin/python3
"""Run by the machine's Python: prints the transforms that ROS has for some joint positions, as JSON.

Arguments: a JSON list of {joint: position}, a JSON list of the links that move. Publishes each as
/joint_states until the moving links' transforms come back with one of its stamps (whoever else
publishes joint states has other stamps), and prints {child: [parent, [x, y, z], [x, y, z, w]]} of each.
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


def heard(message):
    for stamp, child, value in edges(message):
        by_stamp[stamp][child] = value


def heard_static(message):
    fixed.update({child: value for _, child, value in edges(message)})


def transforms(joints, movable, publisher):
    """What comes back for one set of joint positions."""
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
    rospy.Subscriber("/tf", TFMessage, heard)
    rospy.Subscriber("/tf_static", TFMessage, heard_static)
    publisher = rospy.Publisher("/joint_states", JointState, queue_size=10)
    json.dump([transforms(joints, movable, publisher) for joints in positions], sys.stdout)


main()
