r"""
Through the unstable equilibrium
================================

Fig. 5: while the first modal amplitude passes zero, the higher modes determine the shape of the beam, most often the
third mode. Grey: the higher modes together exceed the first.
"""

import numpy as np

from snapbeam import paper

results = paper.shared_results()
figure = paper.fig5(results=results)

# %%
# How much of the time that :math:`|\alpha_1|` is below 5 % of its value at rest do the others exceed it?

run, along = results["fig5"]["run"], results["fig5"]["shapes"]
alpha = run.modal_amplitude.values / abs(along.attrs["rest_amplitude"])
near = np.abs(alpha[:, 0]) < 0.05
others = np.sqrt((alpha[near, 1:] ** 2).sum(axis=1))
print(f"{100 * (others > np.abs(alpha[near, 0])).mean():.0f} %")

# %%
# Which of the higher modes is the largest?

leading = np.abs(alpha[near, 1:]).argmax(axis=1) + 2
for mode in np.unique(leading):
    print(f"mode {mode}: {100 * (leading == mode).mean():.0f} %")
