"""The schematic shows what the system holds."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

import snapbeam as sb
from snapbeam.model import default_values
from snapbeam.plot.schematic import plot_system

LEVEL = default_values.BEAM.buckling_level


@pytest.fixture
def model():
    return sb.ReducedModel.from_beam(default_values.BEAM, modes=3)


def words(figure) -> str:
    found = " ".join(text.get_text() for ax in figure.axes for text in ax.texts)
    plt.close(figure)
    return found


def test_says_what_signs_do_not(model) -> None:
    drive = sb.Burst(frequency_ratio=1.2, velocity_amplitude=0.2, duration_cycles=4.0)
    striker = sb.Striker(drive=drive, mass=0.02, suspension_stiffness=700.0, suspension_damping=0.7, gap=0.1 * LEVEL)
    said = words(plot_system(sb.System(model, contacts=[sb.Contact(sb.HuntCrossley(4e8, 2.0), striker)])))
    assert "Hunt–Crossley" in said
    assert "gap 33.5 µm" in said
    assert "= 20 g" in said
    pressed = sb.Striker(drive=sb.FixedStop(), gap=-0.2 * LEVEL)
    assert "preload 67 µm" in words(
        plot_system(sb.System(model, contacts=[sb.Contact(default_values.CONTACT, pressed)]))
    )


def test_beam_and_tip_are_where_they_are(model) -> None:
    striker = sb.Striker(drive=sb.ConstantVelocity(speed=0.4), mass=2e-3, gap=0.5 * LEVEL, side="above", location=0.5)
    figure = plot_system(sb.System(model, contacts=[sb.Contact(default_values.CONTACT, striker)]))
    solid = next(line for line in figure.axes[0].lines if line.get_linewidth() == 1.8)
    assert solid.get_ydata().max() == pytest.approx(1.0, abs=1e-3)
    tip = next(patch for patch in figure.axes[0].patches if hasattr(patch, "radius"))
    assert tip.center[0] == pytest.approx(3.5)
    assert tip.center[1] - tip.radius == pytest.approx(1.5, abs=1e-3)
    drive = figure.axes[1].lines[0].get_ydata()
    assert drive[0] == 0.0
    assert drive[-1] == pytest.approx(2.0 * 2.0 * 3.141592653589793 * 0.4, rel=1e-9)
    plt.close(figure)


def test_what_surrounds_the_beam_is_drawn_and_named(model) -> None:
    """A base, a load that changes, and a harvester of each kind, beside the beam that has none of them."""
    striker = sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2)
    base = sb.BaseExcitation(motion=sb.AccelerationSine(frequency_ratio=0.9, acceleration_amplitude=0.25))
    load = sb.AxialLoadModulation(motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=3.0))
    piezo = sb.PiezoelectricHarvester(
        moment_per_volt=4e-3, capacitance=60e-9, resistance=2e4, patch_start=0.0, patch_end=0.25
    )
    coil = sb.ElectromagneticHarvester(force_factor=1.5, resistance=30.0, coil_resistance=10.0, location=0.4)

    def drawn(**around) -> tuple[int, str]:
        figure = plot_system(sb.System(model, contacts=[sb.Contact(default_values.CONTACT, striker)], **around))
        shapes = sum(len(ax.get_children()) for ax in figure.axes)
        return shapes, words(figure)

    plain, said = drawn()
    for around in ({"base_excitation": base}, {"harvesters": [piezo]}, {"harvesters": [coil]}):
        shapes, more = drawn(**around)
        assert shapes > plain, around
        assert len(more) > len(said), around
    # the arrow of the load is there anyway
    assert drawn(axial_load=load)[1] == said.replace("$P$", "$P(t)$") and "$P$" in said


def test_every_force_and_every_motion_is_drawn(model) -> None:
    """Arrows and signs where the forces act, and a panel of each motion, of a sum with both of its names."""
    figure = plot_system(
        sb.System(
            model,
            contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2))],
            forces=[
                sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=1.0, amplitude=0.1), location=0.3),
                sb.LocalSpring(stiffness=100.0, location=0.75),
                sb.QuadraticDamping(coefficient=1.0, location=0.15, label="oil"),
                sb.ExternalForce(history=sb.model.HalfSineForce(peak=1.0, duration=0.2), location=0.6),
            ],
            axial_load=sb.AxialLoadModulation(
                motion=sb.HarmonicForce(frequency_ratio=2.0, amplitude=1.0) + sb.RampForce(change=1.0, duration=3.0)
            ),
        )
    )
    beam, *panels = figure.axes
    placed = {text.get_text(): text.get_position()[0] / 7.0 for text in beam.texts}
    assert placed["$F_1(t)$"] == pytest.approx(0.32) and placed["$F_4(t)$"] == pytest.approx(0.58)
    assert placed["spring"] == pytest.approx(0.73) and placed["oil"] == pytest.approx(0.17)
    titles = [panel.get_title("left") or panel.get_title("right") for panel in panels]
    assert titles == ["Drive: sine", "Axial load: harmonic + ramp", "Force: harmonic", "Force 4: half sine"]
    assert np.ptp(panels[2].lines[0].get_ydata()) == pytest.approx(0.2, rel=1e-3)
    figure.canvas.draw()
    for panel in panels:
        assert panel.get_tightbbox().xmax <= figure.bbox.xmax + 1.0


def test_no_motion_is_left_out(model) -> None:
    pushes = [
        sb.ExternalForce(history=sb.HarmonicForce(frequency_ratio=0.5 * n, amplitude=0.1), location=0.1 * n)
        for n in range(1, 6)
    ]
    titles = [panel.get_title("left") for panel in plot_system(sb.System(model, forces=pushes)).axes[1:]]
    assert titles == ["Force: harmonic", *(f"Force {n}: harmonic" for n in range(2, 6))]


def test_free_beam(model) -> None:
    figure = plot_system(sb.System(model))
    assert len(figure.axes) == 1
    plt.close(figure)


def test_a_structure_by_matrices_is_a_body_in_both_of_its_wells() -> None:
    model = sb.ReducedModel.from_matrices(
        np.diag([2e-3, 1e-3]), [[-300.0, -500.0], [-500.0, 500.0]], contact_shape=[0.0, 1.0], base_shape=[1.0, 1.0],
        nonlinear_stiffness=5e8, elongation_matrix=[[1.0, 0.0], [0.0, 0.0]], well_amplitude=[-((800.0 / 5e8) ** 0.5)] * 2,
        length_scale=1.265e-3,
    )  # fmt: skip
    stop = sb.Contact(sb.HertzContact(1e9), sb.Striker(drive=sb.FixedStop(), side="above", gap=5e-4), label="end")
    shock = sb.BaseExcitation(motion=sb.Shock(acceleration_g=50.0, duration_ms=5.0))
    figure = plot_system(sb.System(model, contacts=[stop], base_excitation=shock))
    faces = [patch.get_y() for patch in figure.axes[0].patches if getattr(patch, "get_height", float)() == 0.24]
    assert sorted(faces) == pytest.approx([-1.24, 0.76], abs=1e-3)  # their upper faces are in the wells
    assert figure.axes[1].get_ylabel() == "Base acceleration (g)" and figure.axes[1].get_xlabel() == "Time (ms)"
    assert figure.axes[1].lines[0].get_ydata().max() == pytest.approx(50.0, rel=1e-4)
    said = words(figure)
    assert "2 coordinates" in said and "end: Hertz" in said and "gap 500 µm" in said


def test_stops_on_both_sides_lie_in_the_picture(model) -> None:
    stops = [
        sb.Contact(sb.HertzContact(1e9), sb.Striker(drive=sb.FixedStop(), side=side, gap=gap * LEVEL))
        for side, gap in (("above", 0.5), ("below", 2.4))
    ]
    figure = plot_system(sb.System(model, contacts=stops))
    ax = figure.axes[0]
    low, high = ax.get_ylim()
    tips = [patch for patch in ax.patches if hasattr(patch, "radius")]
    assert [tip.center[1] for tip in tips] == pytest.approx([1.6, -1.5], abs=1e-2)
    for patch in ax.patches:
        box = patch.get_extents().transformed(ax.transData.inverted())
        assert low <= box.ymin and box.ymax <= high
    plt.close(figure)


def test_unequal_wells_and_what_makes_them(model) -> None:
    uneven = sb.ReducedModel.from_beam(
        default_values.BEAM,
        modes=3,
        imperfection=sb.Imperfection(midspan_amplitude=1.5e-5, point_load=-0.02, point_location=0.3),
    )
    figure = plot_system(
        sb.System(
            uneven,
            contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2))],
        )
    )
    solid, dashed = (
        next(line for line in figure.axes[0].lines if line.get_linewidth() == width) for width in (1.8, 0.8)
    )
    heights = uneven.wells @ uneven.midspan_shape / LEVEL
    assert solid.get_ydata()[100] == pytest.approx(heights[0], rel=1e-9)
    assert dashed.get_ydata()[100] == pytest.approx(heights[1], rel=1e-9)
    assert "$F$" in words(figure)


def test_no_arrows_of_a_load_that_is_zero() -> None:
    """An arch without an axial load has neither the arrows at its ends nor their symbol."""
    arch = default_values.BEAM.replace(buckling_level=None, axial_load=0.0)
    imperfection = sb.Imperfection(midspan_amplitude=2e-3)
    model = sb.ReducedModel.from_beam(arch, modes=3, imperfection=imperfection)
    arched = sb.System(
        model, contacts=[sb.Contact(default_values.CONTACT, sb.Shaker(frequency_ratio=1.2, velocity_amplitude=0.2))]
    )
    assert "$P$" not in words(plot_system(arched))
    loaded = sb.ReducedModel.from_beam(default_values.BEAM, modes=3)
    assert "$P$" in words(plot_system(arched.replace(model=loaded)))
