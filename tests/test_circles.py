"""Imports of modules go one way, those inside functions included."""

from __future__ import annotations

from graphlib import TopologicalSorter

import grimp
import pytest

ALLOWED = ("snapbeam.model.system", "snapbeam.model.parameter_file")
"""``System.load`` reads a parameter file, and a parameter file makes a system."""


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("snapbeam", exclude_type_checking_imports=True, cache_dir=None)


@pytest.mark.parametrize("package", ["snapbeam.model", "snapbeam.dynamics"])
def test_no_circle(graph: grimp.ImportGraph, package: str) -> None:
    modules = {package, *graph.find_descendants(package)}
    sorter: TopologicalSorter[str] = TopologicalSorter()
    for module in modules:
        imported = graph.find_modules_directly_imported_by(module) & modules
        sorter.add(module, *(each for each in imported if (module, each) != ALLOWED))
    order = list(sorter.static_order())  # CycleError names the circle
    assert len(order) == len(modules) > 10
