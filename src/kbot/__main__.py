"""`python -m kbot`."""

from kbot.cli.start import main

main()
