// Generated from src/kbot/messages; do not edit.

/** A time of the simulation's clock. `nanosec` is from 0 to 999999999. */
export interface Time {
  sec: number;
  nanosec: number;
}

export interface Header {
  stamp: Time;
  frame_id: string;
}

export interface Vector3 {
  x: number;
  y: number;
  z: number;
}

export interface Point {
  x: number;
  y: number;
  z: number;
}

export interface Quaternion {
  x: number;
  y: number;
  z: number;
  w: number;
}

export interface Pose {
  position: Point;
  orientation: Quaternion;
}

export interface PoseWithCovariance {
  pose: Pose;
  covariance: readonly number[];
}

/** `linear` in m/s along x, y, z, `angular` in rad/s about them. */
export interface Twist {
  linear: Vector3;
  angular: Vector3;
}

export interface TwistStamped {
  header: Header;
  twist: Twist;
}

export interface TwistWithCovariance {
  twist: Twist;
  covariance: readonly number[];
}

/** `pose` in `header.frame_id`, `twist` in `child_frame_id`. */
export interface Odometry {
  header: Header;
  child_frame_id: string;
  pose: PoseWithCovariance;
  twist: TwistWithCovariance;
}

/** One entry per joint. An empty list means that the quantity is unknown. */
export interface JointState {
  header: Header;
  name: readonly string[];
  position: readonly number[];
  velocity: readonly number[];
  effort: readonly number[];
}

export interface Transform {
  translation: Vector3;
  rotation: Quaternion;
}

/** The pose of `child_frame_id` in `header.frame_id`. */
export interface TransformStamped {
  header: Header;
  child_frame_id: string;
  transform: Transform;
}

export interface TFMessage {
  transforms: readonly TransformStamped[];
}

/** rosgraph_msgs/Clock. */
export interface ClockMessage {
  clock: Time;
}

export interface String {
  data: string;
}

/** `ranges` in m. +inf: no return. -inf: an object is closer than `range_min` (REP 117). */
export interface LaserScan {
  header: Header;
  angle_min: number;
  angle_max: number;
  angle_increment: number;
  time_increment: number;
  scan_time: number;
  range_min: number;
  range_max: number;
  ranges: Float32Array;
  intensities: Float32Array;
}

/** Angular velocity in rad/s and specific force in m/s^2, in the sensor's axes. At rest, the specific force is that of gravity, upwards. */
export interface Imu {
  header: Header;
  orientation: Quaternion;
  orientation_covariance: readonly number[];
  angular_velocity: Vector3;
  angular_velocity_covariance: readonly number[];
  linear_acceleration: Vector3;
  linear_acceleration_covariance: readonly number[];
}

/** A distance in m, with +inf and -inf as in LaserScan. */
export interface Range {
  header: Header;
  radiation_type: number;
  field_of_view: number;
  min_range: number;
  max_range: number;
  range: number;
  variance: number;
}

export interface NavSatStatus {
  status: number;
  service: number;
}

/** Degrees, and metres above the WGS 84 ellipsoid. The covariance is in m^2 over east, north, up. */
export interface NavSatFix {
  header: Header;
  status: NavSatStatus;
  latitude: number;
  longitude: number;
  altitude: number;
  position_covariance: readonly number[];
  position_covariance_type: number;
}

export interface PointField {
  name: string;
  offset: number;
  datatype: number;
  count: number;
}

/** Points as bytes: `point_step` bytes per point, `row_step` bytes per row. */
export interface PointCloud2 {
  header: Header;
  height: number;
  width: number;
  fields: readonly PointField[];
  is_bigendian: boolean;
  point_step: number;
  row_step: number;
  data: Uint8Array;
  is_dense: boolean;
}

/** Pixels row by row from the top. KBot's cameras publish `encoding` rgb8, and 32FC1 for depth in m. */
export interface Image {
  header: Header;
  height: number;
  width: number;
  encoding: string;
  is_bigendian: number;
  step: number;
  data: Uint8Array;
}

export interface RegionOfInterest {
  x_offset: number;
  y_offset: number;
  height: number;
  width: number;
  do_rectify: boolean;
}

/** Intrinsics in pixels, row by row: `k` (3x3), `r` (3x3), `p` (3x4). Field names are those of ROS 2. */
export interface CameraInfo {
  header: Header;
  height: number;
  width: number;
  distortion_model: string;
  d: readonly number[];
  k: readonly number[];
  r: readonly number[];
  p: readonly number[];
  binning_x: number;
  binning_y: number;
  roi: RegionOfInterest;
}

/** Force in N and torque in N m. */
export interface Wrench {
  force: Vector3;
  torque: Vector3;
}

/** A wrench in the axes of the header's frame. */
export interface WrenchStamped {
  header: Header;
  wrench: Wrench;
}

/** The state of a gamepad. Axes are from 1 (left, forward) to -1. A pressed button is 1. */
export interface Joy {
  header: Header;
  axes: readonly number[];
  buttons: readonly number[];
}

export interface Bool {
  data: boolean;
}

export interface MultiArrayDimension {
  label: string;
  size: number;
  stride: number;
}

export interface MultiArrayLayout {
  dim: readonly MultiArrayDimension[];
  data_offset: number;
}

export interface Float32MultiArray {
  layout: MultiArrayLayout;
  data: readonly number[];
}

export interface PoseStamped {
  header: Header;
  pose: Pose;
}

export interface PoseWithCovarianceStamped {
  header: Header;
  pose: PoseWithCovariance;
}

/** Identifies a goal. In a request to cancel, an empty one means the current goal. */
export interface GoalID {
  stamp: Time;
  id: string;
}

/** Poses in the order of travel. */
export interface Path {
  header: Header;
  poses: readonly PoseStamped[];
}

/** `resolution` in m per cell. `origin` is the pose of the corner of the first cell. */
export interface MapMetaData {
  map_load_time: Time;
  resolution: number;
  width: number;
  height: number;
  origin: Pose;
}

/** Cells row by row from the origin, a row is along x. 0 is free, 100 occupied, -1 unknown. */
export interface OccupancyGrid {
  header: Header;
  info: MapMetaData;
  data: Int8Array;
}

/** The cells of a rectangle of a map, row by row. Its first cell is in column `x` and row `y`. */
export interface OccupancyGridUpdate {
  header: Header;
  x: number;
  y: number;
  width: number;
  height: number;
  data: Int8Array;
}

/** `sec + nanosec * 1e-9` seconds. `nanosec` is from 0 to 999999999, also if `sec` is negative. */
export interface Duration {
  sec: number;
  nanosec: number;
}

export interface Float64 {
  data: number;
}

export interface Float64MultiArray {
  layout: MultiArrayLayout;
  data: readonly number[];
}

/** One number per joint in rad or m, rad/s or m/s, …; N or N m. An empty list leaves the quantity open. */
export interface JointTrajectoryPoint {
  positions: readonly number[];
  velocities: readonly number[];
  accelerations: readonly number[];
  effort: readonly number[];
  time_from_start: Duration;
}

export interface JointTrajectory {
  header: Header;
  joint_names: readonly string[];
  points: readonly JointTrajectoryPoint[];
}

/** Each component is in 0..1. */
export interface ColorRGBA {
  r: number;
  g: number;
  b: number;
  a: number;
}

/** `data` is a file in the given `format`, jpeg or png. */
export interface CompressedImage {
  header: Header;
  format: string;
  data: Uint8Array;
}

export interface UVCoordinate {
  u: number;
  v: number;
}

export interface MeshFile {
  filename: string;
  data: Uint8Array;
}

/** A shape to draw, identified by `ns` and `id`. `type` and `action` are the numbers above. Without a `lifetime` it stays until it is deleted. */
export interface Marker {
  header: Header;
  ns: string;
  id: number;
  type: number;
  action: number;
  pose: Pose;
  scale: Vector3;
  color: ColorRGBA;
  lifetime: Duration;
  frame_locked: boolean;
  points: readonly Point[];
  colors: readonly ColorRGBA[];
  texture_resource: string;
  texture: CompressedImage;
  uv_coordinates: readonly UVCoordinate[];
  text: string;
  mesh_resource: string;
  mesh_file: MeshFile;
  mesh_use_embedded_materials: boolean;
}

export interface MarkerArray {
  markers: readonly Marker[];
}

export interface PoseArray {
  header: Header;
  poses: readonly Pose[];
}

export interface Point32 {
  x: number;
  y: number;
  z: number;
}

/** Corners in order. The last is connected to the first. */
export interface Polygon {
  points: readonly Point32[];
}

export interface PolygonStamped {
  header: Header;
  polygon: Polygon;
}

export interface PointStamped {
  header: Header;
  point: Point;
}
