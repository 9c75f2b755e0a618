"""`kbot launch`: its options, what it prints, and a launch carried out, with a robot or without one."""
