"""Parameters by name: the one table of them, parameter files, axes and units, checked at the door.

A file has the sections ``[beam]``, ``[boundary]``, ``[imperfection]``, ``[model]``, ``[contact]``, ``[striker]``,
``[drive]``, ``[base_excitation]``, ``[axial_load]``, ``[harvester]``, ``[initial_state]``, ``[sweep]`` and ``[integration]``, and of a second striker
``[contact_2]``, ``[striker_2]`` and ``[drive_2]``; what it leaves out takes the paper's value.  A key that does not
exist is refused with the nearest one that does, text where a number belongs is refused, and so is a number so far from
any beam that it must be in another unit.
"""

from snapbeam.config.axes import Axis, parse_axis
from snapbeam.config.parameters import Parameter, lookup, parameters
from snapbeam.config.physical import PHYSICAL, from_physical, to_physical
from snapbeam.config.settings import DEFAULT_AXES, Config, config_from_mapping, override, same_axis
from snapbeam.config.toml import config_text, dump_config, load_config

__all__ = [
    "DEFAULT_AXES",
    "PHYSICAL",
    "Axis",
    "Config",
    "Parameter",
    "config_from_mapping",
    "config_text",
    "dump_config",
    "from_physical",
    "load_config",
    "lookup",
    "override",
    "parameters",
    "parse_axis",
    "same_axis",
    "to_physical",
]
