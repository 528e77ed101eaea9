"""How results show themselves: datasets, notebooks, progress."""

from __future__ import annotations

import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.util.diagnostics import counting, sharing


@pytest.fixture(scope="module")
def system():
    striker = sb.Shaker(frequency_ratio=1.21, velocity_amplitude=0.18)
    return sb.System(sb.ReducedModel.from_beam(default_values.BEAM, modes=1), default_values.CONTACT, striker)


def test_short_words_and_tables(system):
    run = sb.simulate(system, sb.Integration(cycles=3))
    for value in (run, run.summary, system, system.model):
        assert len(repr(value)) < 400
    html = run._repr_html_() + system._repr_html_() + run.summary._repr_html_()
    assert "<table>" in html and "thickness = 0.0004" in html and "peak contact force" in html


def test_progress_in_words(system, capsys):
    axes = {"velocity_amplitude": [0.1, 0.2, 0.3]}
    plain = sb.sweep(system, axes, sb.Integration(cycles=3))
    capsys.readouterr()
    told = sb.sweep(system, axes, sb.Integration(cycles=3), progress=True)
    assert "sweep: 3 of 3 points" in capsys.readouterr().err
    assert told.response_class.equals(plain.response_class)
    sb.simulate(system, sb.Integration(cycles=3), progress=True)
    assert "run: 100 %" in capsys.readouterr().err
    assert counting(None, "a") is counting(False, "a") is sharing(None, "a") is None
    for check in (counting, sharing):
        with pytest.raises(sb.InputTypeError, match="progress = 3: must be True or callable"):
            check(3, "a")


def test_several_systems_at_once(system):
    others = [
        system,
        system.replace(**{"drive.velocity_amplitude": 0.3}),
        system.replace(**{"model.modes": 2}),
    ]
    seen = []
    runs = sb.simulate(
        others, sb.Integration(cycles=5), progress=lambda done, total: seen.append((done, total))
    )
    assert seen == [(1, 3), (2, 3), (3, 3)]
    for one, run in zip(others, runs, strict=True):
        alone = sb.simulate(one, sb.Integration(cycles=5))
        assert run.system == one and dict(run.summary) == pytest.approx(dict(alone.summary), nan_ok=True)
        assert run.dataset.midspan_displacement.equals(alone.dataset.midspan_displacement)
    with pytest.raises(sb.InputTypeError, match=r"system\[1\] = 3: must be a System"):
        sb.simulate([system, 3])
    assert sb.simulate([]) == []
