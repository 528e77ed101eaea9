"""Plots of runs, maps, thresholds and the results of dynamics and uncertainty, in the axes *ax*, or in new ones."""

import lazy_loader

# The stub __init__.pyi lists the public names; each is loaded when it is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
