// Connects with Foxglove's client, subscribes to odometry, drives, and prints what it received as JSON.
import protocol from "@foxglove/ws-protocol";
import WebSocket from "ws";

const { FoxgloveClient } = protocol;
const [address, subprotocol] = process.argv.slice(2);
const client = new FoxgloveClient({ ws: new WebSocket(address, [subprotocol]) });
const found = { statuses: [] };

client.on("error", (error) => {
  console.error(error);
  process.exit(1);
});
client.on("status", (status) => found.statuses.push(status.message));
client.on("serverInfo", (info) => (found.capabilities = info.capabilities));
client.on("parameterValues", (answer) => (found.parameters = answer.parameters));
client.on("time", ({ timestamp }) => (found.time = Number(timestamp)));

let odometry, latched, drive;
client.on("advertise", (channels) => {
  found.topics = [...(found.topics ?? []), ...channels.map((channel) => channel.topic)];
  for (const { id, topic } of channels) {
    if (topic === "/odom") odometry = client.subscribe(id);
    if (topic === "/tf_static") latched = client.subscribe(id);
  }
  if (drive === undefined) {
    drive = client.advertise({ topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/Twist" });
    client.getParameters(["/use_sim_time"], "q");
    setInterval(() => {
      client.sendMessage(drive, new TextEncoder().encode(JSON.stringify({ linear: { x: 0.3 } })));
    }, 50);
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  if (subscriptionId === latched) found.latched = data.byteLength;
  if (subscriptionId !== odometry) return;
  found.stamps = [...(found.stamps ?? []), Number(timestamp)];
  found.last = Buffer.from(data.buffer, data.byteOffset, data.byteLength).toString("base64");
  if (found.stamps.length === 60) {
    console.log(JSON.stringify(found));
    process.exit(0);
  }
});
setTimeout(() => process.exit(2), 30000);
