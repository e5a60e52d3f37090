"""The `tiltvp` command."""


def main() -> None:
    """Entry point."""
