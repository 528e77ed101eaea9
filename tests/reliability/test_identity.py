"""What tells one result from another: a store gives back its own system's numbers, and says what made them."""

from __future__ import annotations

import json

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model.contact.base import LAWS
from snapbeam.sweeps.checkpoint.records import TaskLog, TaskRecord
from snapbeam.sweeps.tasks import differences, provenance_of
from snapbeam.util.provenance import arithmetic_hash, code_hash
from snapbeam.util.validation import InputError

AXES = {"drive.velocity_amplitude": np.array([0.2, 0.4])}
MATRICES = {
    "mass": [[1e-3, 0.0], [0.0, 1e-3]],
    "stiffness": [-60.0, 4000.0],
    "contact_shape": [1.0, 0.3],
    "midspan_shape": [1.0, 0.0],
    "nonlinear_stiffness": 60.0 / (0.335e-3) ** 2,
    "well_amplitude": [-0.335e-3, 0.0],
    "length_scale": 0.335e-3,
    "damping_ratio": 0.005,
}
OTHERS = {
    "mass": [[1.1e-3, 0.0], [0.0, 1e-3]],
    "stiffness": [-60.0, 4100.0],
    "contact_shape": [1.0, 0.4],
    "midspan_shape": [1.0, 0.1],
    "length_scale": 0.3e-3,
    "damping_ratio": 0.006,
}


def system(**changes):
    model = sb.ReducedModel.from_matrices(**MATRICES | changes)
    return sb.System(
        model,
        contacts=[sb.Contact(sb.HertzContact(stiffness=4e8), sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3))],
    )


def test_a_store_gives_back_no_other_structures_numbers(tmp_path):
    """Each number of a structure given by matrices is part of what a store is asked for."""
    store, how = tmp_path / "store", sb.Integration(cycles=2)
    first = sb.sweep(system(), AXES, how, checkpoint=sb.CheckpointOptions(store))
    for name, value in OTHERS.items():
        with pytest.raises(InputError, match=rf"(?s)contains a sweep with other parameters.*system\.model\.{name}"):
            sb.sweep(system(**{name: value}), AXES, how, checkpoint=sb.CheckpointOptions(store))
    again = sb.sweep(system(), AXES, how, checkpoint=sb.CheckpointOptions(store))
    np.testing.assert_array_equal(first["peak_force"], again["peak_force"])


def test_a_file_says_which_structure_it_is_of(tmp_path):
    """Every matrix and shape stands in the attributes, and the hash of the whole system."""
    found = sb.sweep(system(), AXES, sb.Integration(cycles=2))
    held = json.loads(found.attrs["system"])["model"]
    for name in MATRICES:
        np.testing.assert_allclose(held[name], MATRICES[name])
    assert found.attrs["system_hash"] == system().hash
    assert len({system(**{name: value}).hash for name, value in OTHERS.items()}) == len(OTHERS)


def test_representations_are_short():
    """No array of a structure or a record floods a message."""
    model = sb.ReducedModel.from_beam(
        sb.Beam(length=0.161, thickness=0.4e-3, width=15e-3, density=7800.0, young_modulus=200e9,
                buckling_level=0.335e-3), modes=200,
    )  # fmt: skip
    whole = sb.System(
        model,
        contacts=[sb.Contact(sb.HertzContact(stiffness=4e8), sb.Shaker(frequency_ratio=1.0, velocity_amplitude=0.3))],
    )
    assert max(len(repr(each)) for each in (model, whole)) < 1000


def test_what_computed_stands_in_the_store(tmp_path):
    """The versions, the code, the rounding and the processor of each task, and in the result's words."""
    found = sb.sweep(system(), AXES, sb.Integration(cycles=2), checkpoint=sb.CheckpointOptions(tmp_path / "store"))
    (record,) = TaskLog(tmp_path / "store" / "tasks.jsonl").records.values()
    assert record.code == code_hash() and record.arithmetic == arithmetic_hash()
    assert f"numpy {np.__version__}" in record.libraries
    assert found.attrs["reproducible"].startswith("bitwise identical")
    for text in (record.libraries, record.code, record.arithmetic, record.processor):
        assert text in found.attrs["computed_by"]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("libraries", "numpy 2.0.0, python 3.11.2", r"to rounding.*version of NumPy or Python"),
        ("arithmetic", "0" * 16, "to rounding.*kind of rounding in NumPy"),
        ("code", "f" * 16, "as far as the code agrees.*state of its code"),
        ("model", "e" * 64, "to rounding.*reduction of the model"),
    ],
)
def test_parts_that_something_else_computed_are_told(tmp_path, name, value, words):
    """A store that goes on with another NumPy, another rounding or other code promises no equal bits."""
    store, how = tmp_path / "store", sb.Integration(cycles=2)
    axes = {"drive.velocity_amplitude": np.linspace(0.2, 0.5, 4)}
    sb.sweep(system(), axes, how, checkpoint=sb.CheckpointOptions(store, points_per_task=2))
    ledger = store / "tasks.jsonl"
    records = list(TaskLog(ledger).records.values())
    changed = TaskRecord(**vars(records[0]) | {name: value})
    ledger.write_text("".join(f"{record.line()}\n" for record in (changed, records[1])), encoding="utf-8")
    with pytest.warns(UserWarning, match=words):
        found = sb.sweep(system(), axes, how, checkpoint=sb.CheckpointOptions(store))
    assert not found.attrs["reproducible"].startswith("bitwise identical")


ROUNDING = "from snapbeam.util.provenance import arithmetic_hash as a; print(a())"


@pytest.mark.slow
def test_another_kernel_of_linear_algebra_is_another_rounding(python, tried):
    """What OpenBLAS is told to take is seen; the number of its threads does not matter."""

    def rounding(**environment):
        return python(ROUNDING, python.package, **environment).stdout

    here = rounding(OPENBLAS_NUM_THREADS="1")
    assert here == rounding(OPENBLAS_NUM_THREADS="8")
    others = {rounding(OPENBLAS_CORETYPE=name) for name in ("Prescott", "Haswell", "Nehalem")}
    if others == {here}:
        pytest.skip("NumPy's linear algebra is not told by OPENBLAS_CORETYPE here")
    assert len(others | {here}) > 1
    tried("kernels of linear algebra told apart", len(others | {here}))


def test_the_code_of_a_foreign_law_counts(monkeypatch):
    monkeypatch.setattr("snapbeam.model.contact.base.LAWS", dict(LAWS))  # forgotten afterwards

    class OtherLaw(sb.HertzContact):
        """A law of somebody else's."""

        name = "other"

    mine, own = system(), system()
    own = own.replace(**{"contact.law": OtherLaw(stiffness=4e8)})
    assert provenance_of(mine.replace(**{"contact.law": sb.HertzContact(stiffness=4e8)})).code == code_hash()
    assert provenance_of(own).code.startswith(f"{code_hash()}+")
    assert differences([provenance_of(mine), provenance_of(own)]) == ["state of its code"]
    assert differences([]) == []
