"""The residual indentation of the first contact: it is held by a mode of its own, and stands still within a step.

*indentation* of a layout is the element of a row that holds it, or None, by type: of a law without memory nothing of this is
compiled.
"""

from __future__ import annotations

from snapbeam.solver.compilation import inlined
from snapbeam.solver.contact_force import contact_energy, memory_after, with_memory, yield_penetration
from snapbeam.solver.excitation import Tip, tip_about_well
from snapbeam.solver.step_control import ContactKinematics


@inlined
def _law(memory, indentation, law, q):
    if indentation is None:
        return law
    return with_memory(law, memory[q + indentation])


@inlined
def law_at(memory, layout, run, q):
    """The numbers of the first contact's law at a state, whose displacements stand in the row *q*."""
    return _law(memory, layout.indentation, run.tip.law, q)


@inlined
def _tip(memory, indentation, tip, q):
    if indentation is None:
        return tip
    return Tip(tip.offset - memory[q + indentation], with_memory(tip.law, memory[q + indentation]), tip.drive)


@inlined
def tip_at(memory, layout, run, well_sign, q):
    """The tip in coordinates about the well *well_sign*, its penetration measured from the surface at a state."""
    return _tip(memory, layout.indentation, tip_about_well(run.tip, well_sign, run.rest_contact), q)


@inlined
def _unload(memory, indentation, law, q, kinematics, accumulators, outputs):
    if indentation is None:
        return kinematics
    if kinematics.dv > 0.0:
        return kinematics
    after = memory_after(law, accumulators.deepest)
    growth, there = after - memory[q + indentation], with_memory(law, after)
    if growth <= 0.0:
        return kinematics
    memory[q + indentation] = after
    d = kinematics.d - growth
    lost = contact_energy(law, kinematics.d) - contact_energy(there, d)
    accumulators.deepest = yield_penetration(there)
    accumulators.lost += lost
    if outputs is not None:
        accumulators.dissipated += lost
    return ContactKinematics(kinematics.w, kinematics.wv, d, kinematics.dv, kinematics.c, kinematics.cv)


@inlined
def unload(memory, layout, law, q, kinematics, accumulators, outputs):
    """The kinematics after a step in contact, from the surface that is left once the contact unloads.

    The row *q* receives the new indentation; what the contact stored and will not give back is lost.
    """
    return _unload(memory, layout.indentation, law, q, kinematics, accumulators, outputs)
