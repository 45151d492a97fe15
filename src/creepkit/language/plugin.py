"""The mark of a plugin's hooks, as part of the language: a file of a law imports nothing else."""

from creepkit.hookspecs import hookimpl as hookimpl
