r"""
Claims of the paper
===================

This example measures every statement of the paper that a simulation can test, with the rule of its verdict. Without
stored data the numbers are those of a sketch; the page on the reproduction has the full-size numbers.
"""

from snapbeam import paper
from snapbeam.paper.claims import measure_claims
from snapbeam.paper.claims.table import summary

rows = measure_claims(paper.shared_results(), paper.Results())
print(summary(rows))

# %%
# A row contains numbers, a verdict and their description:

row = next(row for row in rows if row.number == "9d")
print(f"{row.says} ({row.source})")
print(f"Rule: {row.rule}")
for name, quantity in row.quantities.items():
    print(f"{name}: {quantity.value:.3f} ± {quantity.uncertainty:.3f}")
print(row.verdict)

# %%
# The natural frequency of one mode is right to a few percent; the frequencies of maximum response
# are not.  They decrease with the velocity of the shaker, until the beam snaps through:

figure = paper.resonance(results=paper.shared_results())
