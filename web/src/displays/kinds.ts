// Generated from src/kbot/workbench/displays; do not edit.

/** `initial` is the value of a new display. Numbers lie from `low` to `high`, `unit` is shown beside them; a colour is `#rrggbb`; a choice is one of `options`. A topic that is empty is the first of the display's type, a frame that is empty the fixed frame. `rviz` is the name in rviz's files, where it has one; a part after a slash lies beneath the part before. Those of a `group` are shown together. */
export interface Property {
  name: string;
  label: string;
  kind: "switch" | "number" | "colour" | "choice" | "text" | "topic" | "frame";
  initial: boolean | number | string;
  low: number;
  high: number;
  unit: string;
  options: readonly string[];
  group: string;
  rviz: string;
}

/** `topic` is the type of the messages it shows, empty where it shows none; of a `single` kind there is one display at most. `rviz` is the class's name without its package. */
export interface DisplayKind {
  name: string;
  about: string;
  properties: readonly Property[];
  topic: string;
  single: boolean;
  rviz: string;
}

export const KINDS: readonly DisplayKind[] = [
  {
    "name": "Grid",
    "about": "Lines on the floor",
    "properties": [
      {
        "name": "cell",
        "label": "Cell size",
        "kind": "number",
        "initial": 0.0,
        "low": 0.0,
        "high": 100.0,
        "unit": "m",
        "options": [],
        "group": "",
        "rviz": "Cell Size"
      },
      {
        "name": "colour",
        "label": "Colour",
        "kind": "colour",
        "initial": "",
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Color"
      }
    ],
    "topic": "",
    "single": true,
    "rviz": "Grid"
  },
  {
    "name": "RobotModel",
    "about": "The robot's shapes and masses",
    "properties": [
      {
        "name": "visual",
        "label": "Visual",
        "kind": "switch",
        "initial": true,
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Visual Enabled"
      },
      {
        "name": "collision",
        "label": "Collision",
        "kind": "switch",
        "initial": false,
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Collision Enabled"
      },
      {
        "name": "inertia",
        "label": "Inertia",
        "kind": "switch",
        "initial": false,
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Mass Properties/Inertia"
      }
    ],
    "topic": "",
    "single": true,
    "rviz": "RobotModel"
  },
  {
    "name": "TF",
    "about": "Frames: their axes and names",
    "properties": [
      {
        "name": "axes",
        "label": "Axes",
        "kind": "switch",
        "initial": false,
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Show Axes"
      },
      {
        "name": "names",
        "label": "Names",
        "kind": "switch",
        "initial": false,
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Show Names"
      },
      {
        "name": "filter",
        "label": "Filter",
        "kind": "text",
        "initial": "",
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Filter (whitelist)"
      }
    ],
    "topic": "",
    "single": true,
    "rviz": "TF"
  },
  {
    "name": "Trail",
    "about": "The way the robot took",
    "properties": [],
    "topic": "",
    "single": true,
    "rviz": ""
  },
  {
    "name": "LaserScan",
    "about": "What a lidar sees",
    "properties": [
      {
        "name": "topic",
        "label": "Topic",
        "kind": "topic",
        "initial": "",
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Topic"
      },
      {
        "name": "size",
        "label": "Size",
        "kind": "number",
        "initial": 4.0,
        "low": 1.0,
        "high": 50.0,
        "unit": "px",
        "options": [],
        "group": "",
        "rviz": "Size (Pixels)"
      },
      {
        "name": "colour",
        "label": "Colour",
        "kind": "colour",
        "initial": "#ff4d6d",
        "low": 0.0,
        "high": 1000000.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Color"
      },
      {
        "name": "alpha",
        "label": "Opacity",
        "kind": "number",
        "initial": 1.0,
        "low": 0.0,
        "high": 1.0,
        "unit": "",
        "options": [],
        "group": "",
        "rviz": "Alpha"
      }
    ],
    "topic": "sensor_msgs/msg/LaserScan",
    "single": false,
    "rviz": "LaserScan"
  }
];
