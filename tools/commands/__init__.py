"""The commands of the command line, by topic: their options, and the tool each one calls.

Commands import what they need when they run, so that `--help` and a mistyped option answer at once.
"""
