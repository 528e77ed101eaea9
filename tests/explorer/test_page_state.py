"""One state of a page: what a file says stays whatever is done, and an address gives back what is shown."""

from __future__ import annotations

from types import SimpleNamespace
from urllib.parse import parse_qs

import numpy as np
import pytest

import snapbeam as sb
from snapbeam.explorer.address import Address
from snapbeam.explorer.cards import SystemCard
from snapbeam.explorer.maps import difference, patched, sections_of, system_from
from snapbeam.explorer.style import look_of
from snapbeam.model.parameter_file import config_from_mapping

POINT = {"drive": {"frequency_ratio": 1.3, "velocity_amplitude": 0.25}}
SHORT = {"extends": "paper", "model": {"modes": 6}, "integration": {"cycles": 30}, **POINT}
FILES = {
    "imperfection": SHORT | {"imperfection": {"midspan_amplitude": 1e-5}},
    "second striker": SHORT | {"contact": [{}, {"location": 0.3, "gap": 2e-5, "side": "above"}]},
    "load instead of level": SHORT | {"beam": {"axial_load": 60.0}},
    "boundary": SHORT | {"boundary": {"left_rotational_stiffness": 5.0}},
    "Newton": SHORT | {"model": {"modes": 1}, "contact": {"coefficient": 0.6}},
    "initial state": SHORT | {"initial_state": {"amplitude[1]": 1.0, "amplitude[3]": -1e-3, "velocity[5]": 2e-5}},
    "two sines": SHORT | {"contact": [{}, {"location": 0.7, "drive": {"type": "sine", "frequency_ratio": 0.4, "velocity_amplitude": 0.1}}]},
    "mass": SHORT | {"contact": {"location": 0.4, "mass": 0.01, "suspension_stiffness": 900.0}},
    "tolerance": SHORT | {"integration": {"cycles": 12, "tolerance": 1e-7, "early_termination": True}},
}  # fmt: skip


def made(name):
    """System and integration of one of the files."""
    config = config_from_mapping(FILES[name])
    return config.system, config.integration


def again(state: Address) -> Address:
    """The state that its own address describes."""
    return Address.read({name: [each.encode() for each in values] for name, values in parse_qs(state.write()).items()})


@pytest.mark.parametrize("name", FILES)
def test_a_system_comes_back_from_an_address(name, system):
    base, after = sections_of(system, sb.Integration(cycles=30)), sections_of(*made(name))
    changes = difference(base, after)
    read = again(Address(changes=changes))
    assert read.words == () and dict(read.changes) == changes
    assert patched(base, read.changes) == after
    assert system_from(patched(base, read.changes)) == made(name)
    assert difference(after, base).keys() >= {key for key, value in changes.items() if value is None}
    assert patched(after, difference(after, base)) == base


def test_random_states_come_back_from_their_addresses():
    rng = np.random.default_rng(59)
    files = [sections_of(*made(name)) for name in FILES]

    def value():
        return float(rng.choice([1.0, -1.0]) * 10.0 ** rng.uniform(-9, 3))

    def point():
        return {
            "drive.frequency_ratio": abs(value()), "drive.velocity_amplitude": abs(value()),
            "contact.location": float(rng.uniform(0.1, 0.9)), "model.modes": int(rng.integers(1, 60)),
            "contact.side": str(rng.choice(["above", "below"])), "integration.early_termination": bool(rng.integers(2)),
        }  # fmt: skip

    for _ in range(200):
        one, other = rng.integers(len(files), size=2)
        low, high = sorted((value(), value()))
        state = Address(
            x="frequency_ratio", y=str(rng.choice(["velocity_amplitude", "location"])), show="peak_force",
            at=point(), b=point() if rng.integers(2) else {}, cut=point(), view=(low, high, low - 1.0, high),
            changes=difference(files[one], files[other]), theme=str(rng.choice(["dark", "default"])),
            type=str(rng.choice(["", "large"])), units=str(rng.choice(["", "physical"])), tab="Phase", card="System",
        )  # fmt: skip
        assert again(state) == state, state
        assert patched(files[one], again(state).changes) == files[other]


@pytest.mark.parametrize("text", ["beam", "a b.c:1", "beam.thickness:4e-4,imperfection:1", "[" * 3000, ".x:1"])
def test_changes_that_are_none_are_told(text):
    read = Address.read({"set": [text.encode()]})
    assert read.changes == {} and read.words and len(read.words[0]) < 250


@pytest.mark.parametrize(
    "text",
    [
        "beam.thickness:[[",
        "integration.cycles:None",
        "nosuch.part:1",
        "model.modes:[1;2]",
        "initial_state.amplitude:[[1];2]",
        "initial_state.x:1",
        "initial_state.velocity:[1;2;3;4;5;6]",
        "contact.3.gap:1e-5",
        "beam:",
    ],
)
def test_changes_that_make_no_system_are_refused(text, system):
    changes = Address.read({"set": [text.encode()]}).changes
    with pytest.raises(sb.InputError):
        system_from(patched(sections_of(system, sb.Integration()), changes))


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_another_law_leaves_the_striker_and_the_other_contact():
    base, how = made("second striker")
    page = SimpleNamespace(shown_system=lambda: (base, how), post=lambda call: call(), look=look_of("default"))
    card = SystemCard(page)
    assert card.changed_fields() == {}
    card.law.value = "power"
    card.fields["contact.force_at_1um"].value, card.fields["contact.exponent"].value = "0.1", "1.5"
    law = sb.PowerLaw(force_at_1um=0.1, exponent=1.5)
    found = system_from(patched(sections_of(base, how), card.changed_fields()))[0]
    assert found == base.replace(**{"contact.law": law})


def _turn(page, title):
    page.page.locator(f'.bk-tab:has-text("{title}")').first.click()


def _open_file(page, name):
    """Give one of the files to the card of the system, as a TOML file."""
    from snapbeam.model.parameter_file import config_text

    _turn(page, "System")
    page.wait(lambda: page.page.locator("input[type=file]").count() > 0, "where a file can be given")
    text = config_text(config_from_mapping(FILES[name]))
    file = {"name": "own.toml", "mimeType": "application/toml", "buffer": text.encode()}
    page.page.locator("input[type=file][accept='.toml']").set_input_files(file)


def _said(name):
    """What the page says of the run of a file."""
    outcome = sb.simulate(*made(name)).summary
    crossing = "crossing" if outcome.zero_crossings == 1 else "crossings"
    return f"{outcome.zero_crossings} {crossing}, {outcome.impacts} impacts"


@pytest.mark.parametrize("name", ["imperfection", "second striker", "load instead of level"])
def test_using_the_system_of_a_file_drops_no_part_of_it(name, tab, served):
    said = _said(name)
    page = tab(served.url)
    _open_file(page, name)
    page.wait(lambda: said in page.head(), f"the run of the file, {said}")
    first = f"{made(name)[0].model.reference_frequency:.6g} Hz"
    assert first in page.text("system-facts")
    page.page.get_by_role("button", name="Use this system").click()
    page.page.get_by_label("width (m)").fill("0.015")  # as it is
    page.page.get_by_role("button", name="Use this system").click()
    page.page.wait_for_timeout(500)
    page.wait(lambda: said in page.head(), "the same run")
    assert first in page.text("system-facts")
    link = tab(page.page.url)
    link.wait(lambda: said in link.head(), "the same run from the address")
    assert "address" not in link.state()
    page.page.get_by_role("button", name="Back to the map's").click()
    page.wait(lambda: page.text("old-words") == "" and said not in page.head(), "the map's system")
    assert "set=" not in page.page.url


def test_fields_show_the_system_at_the_point(tab, served, small_map, system):
    page = tab(served.url)
    x, y = float(small_map["frequency_ratio"][9]), float(small_map["velocity_amplitude"][12])
    page.click(x, y)
    page.wait(lambda: "bitwise identical" in page.notes(), "the run")
    _turn(page, "System")

    def shown(label):
        return float(page.page.get_by_label(label, exact=True).last.input_value())

    page.wait(lambda: page.page.get_by_label("thickness (m)").count() > 0, "the fields")
    assert (shown("frequency ratio"), shown("velocity amplitude"), shown("modes")) == (x, y, 6.0)
    page.page.get_by_label("velocity amplitude", exact=True).last.fill("0.123")
    page.page.get_by_role("button", name="Use this system").click()
    moved = system.replace(**{"drive.frequency_ratio": x, "drive.velocity_amplitude": 0.123})
    outcome = sb.simulate(moved, sb.Integration(cycles=30)).summary
    page.wait(
        lambda: "amplitude 0.123" in page.head() and f"{outcome.impacts} impacts" in page.head(), "the point moved"
    )
    assert page.text("old-words") == "" and "set=" not in page.page.url, "the map is not old"


@pytest.fixture(scope="module")
def sliced(serve, system, tmp_path_factory):
    """A server of a map over modes too, and the map."""
    where = tmp_path_factory.mktemp("sliced")
    axes = {
        "modes": [1, 2, 3], "frequency_ratio": np.linspace(0.5, 2.0, 8), "velocity_amplitude": np.linspace(0.05, 0.4, 6),
    }  # fmt: skip
    found = sb.sweep(system, axes, sb.Integration(cycles=10))
    found.to_netcdf(where / "sliced.nc", engine="h5netcdf")
    return serve("sliced.nc", where=where), found


_SLIDE = """(at) => { for (const model of Bokeh.documents[0]._all_models.values()) {
  if (model.type === 'Slider' && model.end === 2) { model.value = at; return true; } } return false; }"""
_AXES = "x=frequency_ratio&y=velocity_amplitude&show=zero_crossings"


def _cells(page):
    return page.js("() => Array.from(Bokeh.documents[0].get_model_by_name('map-base').data.image[0])")


def test_a_slice_is_in_the_address_and_stays_at_a_reload(tab, sliced):
    server, found = sliced
    page = tab(f"{server.url}?{_AXES}")
    first = _cells(page)
    x, y = float(found["frequency_ratio"][4]), float(found["velocity_amplitude"][3])
    page.click(x, y)
    page.wait(lambda: "modes 1" in page.head() and "bitwise identical" in page.notes(), "the run of one mode")
    assert page.js(_SLIDE, 1)
    page.wait(lambda: "modes 2" in page.head() and "bitwise identical" in page.notes(), "the point follows the slider")
    page.wait(
        lambda: "cut=model.modes:2" in page.page.url and "model.modes:2" in page.page.url.split("at=")[1], "address"
    )
    seen, address = _cells(page), page.page.url
    assert seen != first
    page.page.go_back()
    page.wait(lambda: "modes 1" in page.head() and _cells(page) == first, "the slice before")
    page.page.go_forward()
    page.wait(lambda: "modes 2" in page.head() and _cells(page) == seen, "the slice again")
    page.open(address)
    page.wait(lambda: "modes 2" in page.head() and "bitwise identical" in page.notes(), "the same run")
    assert _cells(page) == seen and page.page.url == address
    page.page.keyboard.press("ArrowRight")
    words = f"frequency ratio {float(found['frequency_ratio'][5]):.6g}, velocity amplitude {y:.6g}, modes 2"
    page.wait(lambda: words in page.head() and "bitwise identical" in page.notes(), words)
