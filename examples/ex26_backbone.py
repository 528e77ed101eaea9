"""
Backbone curves
===============

Frequency of the free, undamped motion of the beam over its amplitude, about a well and across both wells, with one and with
three modes. The motion about a well softens, the motion across both hardens; dots mark motions that are unstable by
an internal resonance.
"""

import snapbeam as sb
from snapbeam import paper

curves, labels = [], []
for modes in (1, 3):
    model = sb.ReducedModel.from_beam(paper.BEAM, modes=modes)
    for well, limit in (("lower", 1.2), ("both", 2.0)):
        curves.append(
            sb.dynamics.backbone_curve(
                sb.System(model), well=well, amplitude_limit=limit
            )
        )
        labels.append(
            f"{'one well' if well == 'lower' else 'both wells'}, {modes} mode{'s' if modes > 1 else ''}"
        )
        print(
            f"{labels[-1]}: {curves[-1].sizes['point']} motions, {curves[-1].attrs['end']}"
        )

sb.plot.plot_backbone(curves, labels=labels)
