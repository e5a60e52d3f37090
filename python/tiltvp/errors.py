"""The exceptions of the package: everything it raises on purpose derives from `TiltvpError`."""

from typing import Final, Self

LONGEST_MESSAGE: Final = 2_000
"""Characters of a message: what was given may be in it, and a file may give megabytes. A path may have 4,096 bytes, of
which the beginning and the end tell most."""


class TiltvpError(Exception):
    """Base of every error the package raises on purpose. Of longer messages the middle is left out."""

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(_shortened(one) if isinstance(one, str) else one for one in arguments))


def _shortened(text: str) -> str:
    if len(text) <= LONGEST_MESSAGE:
        return text
    end = LONGEST_MESSAGE // 4
    begin = LONGEST_MESSAGE - end - 40
    return f"{text[:begin]} ... ({len(text) - begin - end} characters) ... {text[-end:]}"


def counted(count: int, things: str) -> str:
    """Words of a message for so many things, which are given in the plural: "1 gap", "2 gaps"."""
    return f"{count} {things.removesuffix('s') if count == 1 else things}"


class InvalidInputError(TiltvpError, ValueError):
    """An argument has the wrong shape, type or value."""


class CalibrationError(TiltvpError, ValueError):
    """A calibration file or a camera parameter cannot be what it claims to be."""


class UnsupportedFormatError(CalibrationError):
    """A calibration file is well formed, but its format or its lens model is not supported."""


class CalibrationNotFoundError(CalibrationError, FileNotFoundError):
    """There is no calibration file at that path."""


class UnknownLeanError(TiltvpError):
    """How an image leans is not known, or not believed, so that verticals cannot be told from other edges."""


class ImageFileError(TiltvpError, OSError):
    """An image file cannot be read or written."""


class OutputError(TiltvpError, OSError):
    """A file or folder cannot be written: a full disk, no permission, something else in its place."""


class RunError(TiltvpError, RuntimeError):
    """The folder of an evaluation's run cannot be continued or read, or its cluster cannot be used."""


class MissingExtraError(TiltvpError, ImportError):
    """Something needs packages that are installed with an extra, such as `tiltvp[lab]`."""

    @classmethod
    def of(cls, what: str, extra: str, problem: ImportError | str) -> Self:
        """`what` needs an extra, with what is wrong with its packages: they are not there, or cannot be imported."""
        if isinstance(problem, ModuleNotFoundError) and problem.name:
            problem = f"{problem.name.partition('.')[0]}: not installed"
        return cls(f"{what} needs the extra {extra} ({problem}), expected `pip install 'tiltvp[{extra}]'`")


class InternalError(TiltvpError, RuntimeError):
    """A fault of the package itself, which should be reported."""
