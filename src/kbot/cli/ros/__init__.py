"""The verbs and options that `kbot.ros` adds."""
