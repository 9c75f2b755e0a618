"""`python -m kbot`."""

from kbot.cli.main import main

main()
