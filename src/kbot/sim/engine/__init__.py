"""World and robots as a model of the engine, MuJoCo: shapes, joints, contacts, put on the ground."""
