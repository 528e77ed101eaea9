"""Instructions to install a missing package."""

from __future__ import annotations


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
    return (
        f'{what} needs {package}; install it in the folder of the source code with: pip install ".[{extra}]"'
    )
