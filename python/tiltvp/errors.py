"""The exceptions of the package: everything it raises on purpose derives from `TiltvpError`."""


class TiltvpError(Exception):
    """Base of every error the package raises on purpose."""


class InvalidInputError(TiltvpError, ValueError):
    """An argument has the wrong shape, type or value."""


class CalibrationError(TiltvpError, ValueError):
    """A calibration file or a camera parameter cannot be what it claims to be."""


class UnsupportedFormatError(CalibrationError):
    """A calibration file is well formed, but its format or its lens model is not supported."""


class CalibrationNotFoundError(CalibrationError, FileNotFoundError):
    """There is no calibration file at that path."""


class ImageFileError(TiltvpError, OSError):
    """An image file cannot be read or written."""


class RunError(TiltvpError, RuntimeError):
    """The folder of an evaluation's run cannot be continued or read, or its cluster cannot be used."""


class MissingExtraError(TiltvpError, ImportError):
    """Something needs packages that are installed with an extra, such as `tiltvp[lab]`."""


class InternalError(TiltvpError, RuntimeError):
    """A fault of the package itself, which should be reported."""
