r"""
What the paper says, measured
=============================

Every statement of the paper that a simulation can test, with the rule its verdict follows from.  These are the
numbers of a sketch where no data are stored; those of full size are in the page on the reproduction.
"""

from snapbeam import paper
from snapbeam.paper.claims import measure_claims
from snapbeam.paper.claims.table import summary

rows = measure_claims(paper.shared_results(), paper.Results())
print(summary(rows))

# %%
# A row is numbers, a verdict and the words for both:

row = next(row for row in rows if row.number == "9d")
print(f"{row.says} ({row.source})")
print(f"Rule: {row.rule}")
for name, quantity in row.quantities.items():
    print(f"{name}: {quantity.value:.3f} ± {quantity.uncertainty:.3f}")
print(row.verdict)

# %%
# The natural frequency of one mode is right to a few percent; the frequencies at which a shaker moves the beam most
# are not.  They fall as the shaker moves faster, until the beam snaps through:

figure = paper.resonance(results=paper.shared_results())
