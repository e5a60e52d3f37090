"""The laboratory: datasets of known truth, evaluation, measures, plots and reports (`pip install 'tiltvp[lab]'`)."""

from importlib.util import find_spec

from tiltvp.errors import MissingExtraError

__all__: list[str] = []


def _is_missing(package: str) -> bool:
    try:
        return find_spec(package) is None
    except ImportError:
        return True


_missing = [package for package in ("polars", "matplotlib") if _is_missing(package)]
if _missing:
    raise MissingExtraError.of("the laboratory", "lab", f"{' and '.join(_missing)}: not installed")
