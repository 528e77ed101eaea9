"""Instructions to install a missing package."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

_EXTRAS = {
    "lab": ("cv2", "pyuff", "nptdms", "tifffile", "av", "lmfit"),
    "cluster": ("dask", "distributed", "dask_jobqueue"),
    "video": ("imageio_ffmpeg", "PIL"),
    "explorer": ("panel", "bokeh", "tornado", "param"),
    "laws": ("numba",),
    "cuda": ("cuda",),
}
"""Modules that each extra of the distribution installs."""


def extra_of(module: str | None) -> str | None:
    """Return the extra of the distribution that installs a module; None if no extra does."""
    package = (module or "").partition(".")[0]
    return next((extra for extra, modules in _EXTRAS.items() if package in modules), None)


def needs(what: str, package: str | None, extra: str) -> str:
    """Return the message for a missing package of an extra of the distribution.

    Parameters
    ----------
    what : str
        What cannot be done without the package.
    package : str or None
        Name of the package, such as the attribute ``name`` of an ImportError.
    extra : str
        Extra of the distribution that installs the package; several are separated by commas.
    """
    return f'{what} needs {package}; install it in the folder of the source code with: pip install ".[{extra}]"'


@contextmanager
def needing(what: str, extra: str) -> Iterator[None]:
    """Turn a missing package in the block into the message of :func:`needs`."""
    try:
        yield
    except ImportError as error:
        from snapbeam.util.validation import InputError  # NumPy, which `snapbeam --version` loads not

        raise InputError(needs(what, error.name, extra)) from error
