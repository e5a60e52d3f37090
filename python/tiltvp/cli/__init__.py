"""The `tiltvp` command: what a person types. The only place of the package that prints."""

from tiltvp.cli.app import main

__all__ = ["main"]
