"""What made a file: traceable, and nothing in it about whose machine."""

from __future__ import annotations

import getpass
import os
import re
import socket
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import pytest

from snapbeam._version import __version__
from snapbeam.util.files import atomic_path, check_writable
from snapbeam.util.provenance import canonical_json, command_line, made_by, parameter_hash
from snapbeam.util.validation import InputError


def test_no_paths_and_no_host():
    command = command_line(
        ["/opt/env/bin/snapbeam", "map", "-o", "/data/me/map.nc", "--plot=/data/me/map.png", "1/2.1"]
    )
    assert command == "snapbeam map -o map.nc --plot=map.png 1/2.1"
    assert command_line(["C:\\env\\snapbeam.exe", "map", "~/map.nc"]) == "snapbeam.exe map map.nc"
    attributes = made_by({"modes": 32})
    text = " ".join(attributes.values())
    for secret in (os.getcwd(), socket.gethostname(), os.path.expanduser("~")):
        assert secret not in text
    if len(getpass.getuser()) > 4:
        assert getpass.getuser() not in text
    assert not re.search(r"(^|[\s=])/", attributes["command"])
    assert attributes["snapbeam_version"] == __version__
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", attributes["created"])


@dataclass(frozen=True)
class _Point:
    x: float
    y: tuple[int, ...]


class _Kind(IntEnum):
    ONE = 1


def test_equal_parameters_hash_alike():
    one = {"b": 0.335e-3, "a": [4.0, np.float32(2)], "c": {"k": -0.0, "kind": _Kind.ONE}}
    two = {"c": {"kind": 1, "k": 0}, "a": np.array([4, 2]), "b": np.float64(0.335e-3)}
    assert canonical_json(one) == '{"a":[4,2],"b":0.000335,"c":{"k":0,"kind":1}}' == canonical_json(two)
    assert parameter_hash(one) == parameter_hash(two)
    assert parameter_hash(one) != parameter_hash(one | {"b": np.nextafter(0.335e-3, 1.0)})
    assert canonical_json(_Point(0.5, (1, 2))) == '{"x":0.5,"y":[1,2]}'
    assert canonical_json([True, None, "text"]) == '[true,null,"text"]'


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"a": {"b": float("nan")}}, "parameters.a.b = nan: must be finite"),
        ({"a": [1, {2, 3}]}, "must be numbers, text or lists"),
        ({1: 2}, "key 1 must be text"),
    ],
)
def test_what_cannot_be_hashed(parameters, message):
    with pytest.raises(InputError) as refusal:
        canonical_json(parameters)
    assert message in str(refusal.value)


def test_unwritable_paths_are_refused(tmp_path):
    assert check_writable(tmp_path / "map.nc", suffixes=(".nc",)) == tmp_path / "map.nc"
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="is not an existing folder"):
        check_writable(tmp_path / "none" / "map.nc")
    with pytest.raises(InputError, match="must be a file, not a folder"):
        check_writable(tmp_path)
    with pytest.raises(InputError, match=r"must end in \.nc"):
        check_writable(tmp_path / "map.txt", suffixes=(".nc",))
    with pytest.raises(InputError, match="must be a path"):
        check_writable(3)
    with pytest.raises(InputError, match="cannot be written"):
        check_writable("/proc/map.nc" if os.path.isdir("/proc") else tmp_path / "none" / "map.nc")


def test_a_file_is_whole_or_not_there(tmp_path):
    target = tmp_path / "result.txt"
    with atomic_path(target) as temporary:
        temporary.write_text("first", encoding="utf-8")
    with pytest.raises(KeyboardInterrupt), atomic_path(target) as temporary:
        temporary.write_text("half", encoding="utf-8")
        raise KeyboardInterrupt
    assert target.read_text(encoding="utf-8") == "first"
    assert [file.name for file in tmp_path.iterdir()] == ["result.txt"]
