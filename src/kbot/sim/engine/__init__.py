"""MuJoCo's model of world and robots: shapes, joints, contacts and servos."""
