"""Parameters from and to TOML files, checked at the door.

A file has the sections ``[beam]``, ``[model]``, ``[contact]``, ``[shaker]``, ``[map]`` and ``[run]``; what it
leaves out takes the paper's value.  A key that does not exist is refused with the nearest one that does, text
where a number belongs is refused, and so is a number so far from any beam that it must be in another unit.
"""

from snapbeam.config.axes import Axis, parse_axis
from snapbeam.config.sections import (
    BeamSection,
    Config,
    ContactSection,
    MapSection,
    ModelSection,
    RunSection,
    ShakerSection,
)
from snapbeam.config.toml import config_from_mapping, dump_config, load_config, override

__all__ = [
    "Axis",
    "BeamSection",
    "Config",
    "ContactSection",
    "MapSection",
    "ModelSection",
    "RunSection",
    "ShakerSection",
    "config_from_mapping",
    "dump_config",
    "load_config",
    "override",
    "parse_axis",
]
