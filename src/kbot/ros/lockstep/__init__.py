"""Runs `kbot.Node` programs in step with simulated time, so that runs with them are equal bit for bit.

The simulation pauses at every tick. It sends its messages over the transport as usual, and then the tick over
a channel of its own: the time, and the list of messages in the order in which their callbacks run. The node
waits until it has them all, runs callbacks and timers, and answers with the list of messages that it has
published. The simulation waits for those and delivers them before time goes on.
"""
