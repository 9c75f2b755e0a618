// Connects with roslibjs, subscribes to odometry, drives, calls rosapi, and prints the results as JSON.
import * as ROSLIB from "roslib";

const ros = new ROSLIB.Ros({ url: process.argv[2] });
const found = { count: 0 };
ros.on("error", (error) => {
  console.error(error);
  process.exit(1);
});
ros.on("connection", () => {
  const drive = new ROSLIB.Topic({ ros, name: "/cmd_vel", messageType: "geometry_msgs/Twist" });
  setInterval(() => drive.publish({ linear: { x: 0.3, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } }), 50);
  ros.getTopics((answer) => (found.topics = answer.topics));
  new ROSLIB.Param({ ros, name: "/use_sim_time" }).get((value) => (found.parameter = value));
  new ROSLIB.Topic({ ros, name: "/odom", messageType: "nav_msgs/Odometry" }).subscribe((message) => {
    found.count += 1;
    found.speed = message.twist.twist.linear.x;
    if (found.count === 60) {
      console.log(JSON.stringify(found));
      process.exit(0);
    }
  });
});
setTimeout(() => process.exit(2), 30000);
