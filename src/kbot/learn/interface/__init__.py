"""What a policy sees and what it commands, whether it trains, drives a simulation or drives a robot."""
