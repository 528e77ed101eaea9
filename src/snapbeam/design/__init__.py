"""Where and how to strike, how sure, and what matters most: questions to many runs of a system not known exactly."""

import sys
from types import ModuleType
from typing import Any


class _Room(ModuleType):
    """The room, which does what the function of its name does: whichever of the two ``snapbeam.design`` is."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        from snapbeam.design.optimum.design import design

        return design(*args, **options)


sys.modules[__name__].__class__ = _Room
