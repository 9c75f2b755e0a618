"""Makes the calls of the BARN challenge's run.py: places a robot, sends it to a goal, and judges the run.

    python3 challenge_client.py X Y YAW GOAL_X GOAL_Y

Prints the end as JSON. gazebo_msgs is generated, because Debian does not have it.
"""

import json
import math
import sys
import time

import actionlib
import rospy
from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import GetModelState, SetModelState
from geometry_msgs.msg import Quaternion
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from std_msgs.msg import Bool

ROBOT, RADIUS, LIMIT = "kbot", 0.2, 60.0
x, y, yaw, goal_x, goal_y = (float(word) for word in sys.argv[1:])

rospy.init_node("gym", anonymous=True)
rospy.set_param("/use_sim_time", True)
place = rospy.ServiceProxy("/gazebo/set_model_state", SetModelState)
look = rospy.ServiceProxy("/gazebo/get_model_state", GetModelState)
collisions = []
rospy.Subscriber("/collision", Bool, lambda message: collisions.append(message.data))


def position():
    rospy.wait_for_service("/gazebo/get_model_state")
    pose = look(ROBOT, "world").pose
    return pose.position.x, pose.position.y, pose.position.z


state = ModelState(model_name=ROBOT, reference_frame="world")
state.pose.position.x, state.pose.position.y = x, y
state.pose.orientation = Quaternion(0, 0, math.sin(yaw / 2.0), math.cos(yaw / 2.0))
rospy.wait_for_service("/gazebo/set_model_state")
attempts, heights = 0, []
while attempts == 0 or math.dist(position()[:2], (x, y)) > 0.1 or any(collisions):
    place(state)
    attempts += 1
    collisions.clear()
    for _ in range(10):
        heights.append(position()[2])
        time.sleep(0.1)

client = actionlib.SimpleActionClient("/move_base", MoveBaseAction)
goal = MoveBaseGoal()
goal.target_pose.header.frame_id = "map"
goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = goal_x, goal_y
goal.target_pose.pose.orientation = Quaternion(0, 0, 0, 1)
assert client.wait_for_server(rospy.Duration(20)), "no server"
client.send_goal(goal)
while math.dist(position()[:2], (x, y)) < 0.1:
    time.sleep(0.01)
begun = rospy.get_time()
while math.dist(position()[:2], (goal_x, goal_y)) > RADIUS and rospy.get_time() - begun < LIMIT:
    time.sleep(0.05)
result = {
    "attempts": attempts,
    "highest": max(heights),
    "seconds": rospy.get_time() - begun,
    "left": math.dist(position()[:2], (goal_x, goal_y)),
    "collided": any(collisions),
}
json.dump(result, sys.stdout)
