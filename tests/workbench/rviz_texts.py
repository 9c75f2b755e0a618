"""Display files as both versions of rviz write them."""

# as rviz 1 writes it, and as rviz 2 does with another view
RVIZ1 = """\
Panels:
  - Class: rviz/Displays
    Name: Displays
Visualization Manager:
  Class: ""
  Displays:
    - Alpha: 0.5
      Cell Size: 0.25
      Class: rviz/Grid
      Color: 160; 160; 164
      Enabled: true
      Line Style:
        Line Width: 0.03
        Value: Lines
      Name: Grid
      Normal Cell Count: 0
      Offset:
        X: 1
        Y: 0
        Z: 0
      Plane: XZ
      Plane Cell Count: 10
      Reference Frame: <Fixed Frame>
      Value: true
    - Class: rviz/Group
      Enabled: true
      Name: Sensors
      Displays:
        - Class: rviz/LaserScan
          Axis: X
          Color Transformer: AxisColor
          Decay Time: 2
          Enabled: false
          Name: Front lidar
          Size (Pixels): 5
          Queue Size: 10
          Style: Flat Squares
          Topic: /base/scan
          Value: false
        - Class: rviz_plugin_tutorials/Imu
          Enabled: true
          Name: Imu
    - Class: rviz/Image
      Enabled: true
      Image Topic: /camera/image
      Name: Eye
    - Class: rviz/RobotModel
      Alpha: 0.75
      Collision Enabled: true
      Enabled: true
      Links:
        All Links Enabled: true
        left_wheel:
          Alpha: 0.25
          Show Axes: false
          Value: false
      Name: RobotModel
      Robot Description: robot_description
  Enabled: true
  Global Options:
    Background Color: 48; 49; 255
    Fixed Frame: odom
    Frame Rate: 30
  Name: root
  Tools:
    - Class: rviz/Interact
  Views:
    Current:
      Class: rviz/Orbit
      Distance: 2
      Focal Point:
        X: 1
        Y: 0
        Z: 0
      Pitch: 0.5
      Yaw: 1.5707963
    Saved: ~
Window Geometry:
  Height: 846
"""


RVIZ2 = """\
Visualization Manager:
  Displays:
    - Class: rviz_default_plugins/Map
      Alpha: 0.7
      Color Scheme: costmap
      Enabled: true
      Name: Map
      Topic:
        Depth: 5
        Durability Policy: Transient Local
        Value: /map
      Update Topic:
        Value: /map_updates
      Use Timestamp: false
    - Class: rviz_default_plugins/Odometry
      Enabled: true
      Name: Odometry
      Keep: 50
      Covariance:
        Value: true
        Position:
          Alpha: 0.4
          Color: 204; 51; 204
      Shape:
        Color: 255; 25; 0
        Shaft Length: 0.3
        Value: Arrow
      Topic:
        Value: /odom
  Global Options:
    Fixed Frame: map
  Views:
    Current:
      Class: rviz_default_plugins/TopDownOrtho
      Angle: 0
      Scale: 100
      X: 1
      Y: 2
"""
