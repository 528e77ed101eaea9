"""Frequency responses and spectra of universal files, ASCII and binary."""

from __future__ import annotations

import numpy as np
import pytest
import pyuff
from test_other_texts import UFF

import snapbeam as sb
from snapbeam import lab
from snapbeam.util.validation import InputError

LINES = 2.5 * np.arange(33) + 10.0
RESPONSE = 3.0 / (1.0 - (LINES / 40.0) ** 2 + 0.02j * LINES / 40.0)


def record(path, values, function, *, binary, even=1, over="Hz", units=("m/s", "N")):
    entry = pyuff.prepare_58(
        binary=binary, id1="tip over hammer", func_type=function, rsp_node=1, rsp_dir=3, ref_node=2, ref_dir=3, data=values,
        x=LINES, num_pts=LINES.size, abscissa_spacing=even, abscissa_min=LINES[0], abscissa_inc=LINES[1] - LINES[0],
        abscissa_spec_data_type=18, abscissa_axis_units_lab=over, ordinate_axis_units_lab=units[0],
        orddenom_axis_units_lab=units[1], ordinate_spec_data_type=0, orddenom_spec_data_type=0, z_axis_spec_data_type=0, return_full_dict=False,
    )  # fmt: skip
    entry["n_bytes"] = values.nbytes
    pyuff.UFF(str(path)).write_sets([entry], mode="add")
    return path


@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("even", [0, 1])
def test_responses_and_spectra(tmp_path, binary, even):
    path = tmp_path / "a.uff"
    record(path, RESPONSE, 4, binary=binary, even=even)
    record(path, np.abs(RESPONSE) ** 2, 9, binary=binary, even=even, units=("(m/s)^2/Hz", "NONE"))
    with pytest.raises(InputError, match=r"no whole time response .* read its 2 spectra by lab\.read_spectra"):
        lab.read_channels(path)
    response, density = lab.read_spectra(path)
    np.testing.assert_allclose(response.values, RESPONSE, rtol=1e-5)
    np.testing.assert_allclose(response.frequency, LINES)
    assert response.attrs["units"] == "m/s/N" and response.attrs["function"] == "frequency response"
    assert response.name == "tip over hammer"
    np.testing.assert_allclose(density.values, np.abs(RESPONSE) ** 2, rtol=1e-5)
    assert (density.attrs["units"], density.attrs["function"]) == ("(m/s)^2/Hz", "power spectral density")


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_response_returns_from_an_export(tmp_path):
    noise = np.random.default_rng(4).standard_normal(8000)
    force, motion = (
        lab.make_signal(noise, "N", 1000.0, name="force"),
        lab.make_signal(-2.0 * noise, "mm", 1000.0, name="tip"),
    )
    found = lab.frequency_response(force, motion, resolution=10.0)
    sb.write_table(found, tmp_path / "a.uff")
    response, coherence = lab.read_spectra(tmp_path / "a.uff")
    np.testing.assert_allclose(np.abs(response), found.magnitude, rtol=1e-6)
    np.testing.assert_allclose(np.angle(response), np.angle(np.exp(1j * found.phase)), atol=1e-6)
    np.testing.assert_allclose(coherence, found.coherence)
    assert response.attrs["units"] == "m/N" and coherence.attrs["function"] == "coherence"


def test_what_is_no_spectrum_is_refused(tmp_path):
    path = tmp_path / "a.uff"
    path.write_text(
        UFF.format(kind=4, count=4, even=1, step="5.00000E-04", body="  1.0  2.0  3.0  4.0"), encoding="ascii"
    )
    with pytest.raises(InputError, match="has no spectrum"):
        lab.read_spectra(path)
    path.write_text(
        path.read_text(encoding="ascii").replace("    1         0    0", "    4         0    0"), encoding="ascii"
    )
    with pytest.raises(InputError, match=r"abscissa is in 's', not in Hz"):
        lab.read_spectra(path)
    path.write_bytes(b"    -1\n    58\nbroken")
    with pytest.raises(InputError, match=r"a\.uff"):
        lab.read_spectra(path)
    with pytest.raises(InputError, match="no such file"):
        lab.read_spectra(tmp_path / "b.uff")
