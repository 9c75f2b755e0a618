"""A client of the action move_base with Debian's actionlib, rospy and move_base_msgs.

Takes a list of goals as JSON: x, y, frame, and the seconds after which the goal is cancelled or replaced by
the next one. Prints the end of each goal as JSON. The client of actionlib connects only if the MD5 sums of
both sides agree.
"""

import json
import sys

import actionlib
import rospy
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal


def drive(client, wanted):
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = wanted.get("frame", "map")
    goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = wanted["x"], wanted["y"]
    goal.target_pose.pose.orientation.w = 1.0
    feedback = []
    client.send_goal(goal, feedback_cb=feedback.append)
    handle = client.gh
    if "cancel_after" in wanted:
        rospy.sleep(wanted["cancel_after"])
        client.cancel_goal()
    if "replace_after" in wanted:
        rospy.sleep(wanted["replace_after"])
    else:
        assert client.wait_for_result(rospy.Duration(60)), "no result"
    return handle, feedback


def report(handle, feedback):
    poses = [message.base_position for message in feedback]
    return {
        "state": handle.get_terminal_state(),
        "text": handle.get_goal_status_text(),
        "feedback": len(poses),
        "frames": sorted({pose.header.frame_id for pose in poses}),
        "last": [poses[-1].pose.position.x, poses[-1].pose.position.y] if poses else None,
    }


rospy.init_node("driver", anonymous=True)
client = actionlib.SimpleActionClient("/move_base", MoveBaseAction)
assert client.wait_for_server(rospy.Duration(20)), "no server"
sent = [drive(client, wanted) for wanted in json.loads(sys.argv[1])]
json.dump([report(*one) for one in sent], sys.stdout)
