"""Run the command line with `python -m kbot`."""

from kbot.cli.start import main

main()
