"""snapbeam: the impact dynamics of buckled, bistable beams.

A `System` describes the beam, the contacts, the strikers and their excitation; an `Integration` holds the settings
of the solver. `simulate` computes one run, `sweep` many, and `threshold` the excitation at which the beam begins to
snap through. The namespaces `snapbeam.dynamics`, `snapbeam.uncertainty`, `snapbeam.model` and `snapbeam.plot` hold
further functions; `snapbeam.lab`, `snapbeam.explorer` and `snapbeam.paper` are optional parts.
"""

from typing import Any

import lazy_loader

from snapbeam.parts import PARTS, load_part

# The stub __init__.pyi lists the public names; each is loaded when it is first used.
_load_public_name, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    return load_part(name) if name in PARTS else _load_public_name(name)
