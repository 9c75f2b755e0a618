"""The rules, one function each, one file a family; `kbot.checks.registry` imports them on first use."""
