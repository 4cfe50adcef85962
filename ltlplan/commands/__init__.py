"""The commands of the command line, one module each: parse, call what the library offers, show what came of it.

A command has as many parameters as users have options: its signature is what `--help` shows.
"""
