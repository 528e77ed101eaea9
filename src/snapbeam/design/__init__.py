"""Where and how to strike, how sure, and what matters most: questions to many runs of a system not known exactly."""

import sys
from inspect import Signature, signature
from types import ModuleType
from typing import Any


class _Room(ModuleType):
    """The room, which does what the function of its name does: whichever of the two ``snapbeam.design`` is."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        from snapbeam.design.optimum.design import design

        return design(*args, **options)

    @property
    def __doc__(self) -> str | None:  # type: ignore[override]
        """What the function does: the words above are for who reads this file."""
        from snapbeam.design.optimum.design import design

        return design.__doc__

    @property
    def __signature__(self) -> Signature:
        from snapbeam.design.optimum.design import design

        return signature(design)


sys.modules[__name__].__class__ = _Room
