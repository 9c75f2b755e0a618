"""What a robot perceives: lidar, IMU, encoders and the rest, with their noise and rates."""
