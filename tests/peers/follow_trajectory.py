"""A client of the action control_msgs/FollowJointTrajectory with Debian's actionlib and rospy.

Debian does not have control_msgs, so the types are generated from their published definitions. The client of
actionlib connects only if the MD5 sums of both sides agree. Prints the result of each goal as JSON.
"""

import json
import sys

import actionlib
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus
from genpy.dynamic import generate_dynamic
from std_msgs.msg import Header

STEM = "/arm/follow/follow_joint_trajectory"
WAY = "trajectory_msgs/JointTrajectoryPoint"
TYPES = {
    "control_msgs/FollowJointTrajectoryAction": "FollowJointTrajectoryActionGoal action_goal\n"
    "FollowJointTrajectoryActionResult action_result\nFollowJointTrajectoryActionFeedback action_feedback",
    "control_msgs/JointTolerance": "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration",
    "control_msgs/FollowJointTrajectoryGoal": "trajectory_msgs/JointTrajectory trajectory\n"
    "JointTolerance[] path_tolerance\nJointTolerance[] goal_tolerance\nduration goal_time_tolerance",
    "control_msgs/FollowJointTrajectoryResult": "int32 error_code\nint32 SUCCESSFUL = 0\n"
    "int32 INVALID_GOAL = -1\nint32 INVALID_JOINTS = -2\nint32 OLD_HEADER_TIMESTAMP = -3\n"
    "int32 PATH_TOLERANCE_VIOLATED = -4\nint32 GOAL_TOLERANCE_VIOLATED = -5\nstring error_string",
    "control_msgs/FollowJointTrajectoryFeedback": "Header header\nstring[] joint_names\n"
    f"{WAY} desired\n{WAY} actual\n{WAY} error",
    "control_msgs/FollowJointTrajectoryActionGoal": "Header header\nactionlib_msgs/GoalID goal_id\n"
    "FollowJointTrajectoryGoal goal",
    "control_msgs/FollowJointTrajectoryActionResult": "Header header\nactionlib_msgs/GoalStatus status\n"
    "FollowJointTrajectoryResult result",
    "control_msgs/FollowJointTrajectoryActionFeedback": "Header header\nactionlib_msgs/GoalStatus status\n"
    "FollowJointTrajectoryFeedback feedback",
    "trajectory_msgs/JointTrajectoryPoint": "float64[] positions\nfloat64[] velocities\n"
    "float64[] accelerations\nfloat64[] effort\nduration time_from_start",
    "trajectory_msgs/JointTrajectory": "Header header\nstring[] joint_names\nJointTrajectoryPoint[] points",
    **{kind._type: kind._full_text.partition("=" * 80)[0] for kind in (Header, GoalID, GoalStatus)},
}


def action():
    (first, text), *others = TYPES.items()
    parts = [text, *(f"MSG: {name}\n{text}" for name, text in others)]
    return generate_dynamic(first, ("\n" + "=" * 80 + "\n").join(parts))


def follow(client, types, wanted):
    feedback = []
    goal = types["control_msgs/FollowJointTrajectoryGoal"]()
    goal.trajectory.joint_names = wanted["joints"]
    for seconds, positions in wanted["points"]:
        point = types["trajectory_msgs/JointTrajectoryPoint"]()
        point.positions = [float(position) for position in positions]
        point.time_from_start = rospy.Duration(seconds)
        goal.trajectory.points.append(point)
    client.send_goal(goal, feedback_cb=feedback.append)
    if "cancel_after" in wanted:
        rospy.sleep(wanted["cancel_after"])
        client.cancel_goal()
    assert client.wait_for_result(rospy.Duration(30)), "no result"
    result = client.get_result()
    return {
        "state": client.get_state(),
        "code": result.error_code,
        "words": result.error_string,
        "feedback": len(feedback),
    }


rospy.init_node("follower", anonymous=True)
types = action()
client = actionlib.SimpleActionClient(STEM, types["control_msgs/FollowJointTrajectoryAction"])
assert client.wait_for_server(rospy.Duration(20)), "no server"
json.dump([follow(client, types, wanted) for wanted in json.loads(sys.argv[1])], sys.stdout)
