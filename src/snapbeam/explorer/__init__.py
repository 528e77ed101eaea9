"""The explorer: a response map in the browser; a click on a point computes its run.

It computes through the public interface and draws with Bokeh.
"""

from typing import Any

import lazy_loader

from snapbeam.util.packages import extra_of, needs

# The stub __init__.pyi lists the public names; each is loaded when it is first used.
_load_public_name, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    try:
        return _load_public_name(name)
    except ModuleNotFoundError as error:
        if (extra := extra_of(error.name)) is None:
            raise
        raise ModuleNotFoundError(needs(__name__, error.name, extra), name=error.name) from error
