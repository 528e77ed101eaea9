"""Formulas of docstrings as the pages show them: Matplotlib's own reader of formulas must understand each."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path

import pytest
from matplotlib.mathtext import MathTextParser

ROOT = Path(__file__).parents[2]
_spec = importlib.util.spec_from_file_location("formulas", ROOT / "docs" / "_ext" / "formulas.py")
formulas = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(formulas)


def _docstrings():
    for path in sorted((ROOT / "src" / "snapbeam").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.FunctionDef, ast.ClassDef, ast.Module)) and ast.get_docstring(node):
                yield f"{path.stem}.{getattr(node, 'name', '')}", ast.get_docstring(node).splitlines()


@pytest.mark.slow
def test_every_displayed_formula_can_be_set():
    parser, seen = MathTextParser("path"), 0
    for name, lines in _docstrings():
        for first, end in formulas.displayed(lines):
            for line in lines[first:end]:
                text = formulas.to_latex(line.strip())
                seen += 1
                try:
                    parser.parse(f"${text.replace(chr(92) + 'qquad', chr(92) + 'quad')}$")
                except ValueError as error:
                    raise AssertionError(f"{name}: {line.strip()} as {text}") from error
    assert seen > 25


@pytest.mark.parametrize(
    ("plain", "latex"),
    [
        ("b^2 = 4 L^2 (P - P_cr)", r"b^{2} = 4 L^{2} (P - P_{\mathrm{cr}})"),
        ("sqrt(2)/(k_i sqrt(L))", r"\sqrt{2}/(k_{i} \sqrt{L})"),
        ("d^(3/2)", "d^{3/2}"),
        ("v'''' + Lambda v''", r"v'''' + \Lambda  v''"),
        ("nu_1^2", r"\nu_{1}^{2}"),
        ("rho S (delta_ij + c_ij)", r"\rho  S (\delta_{ij} + c_{ij})"),
        ("k_c d^(3/2) = k_l d^2.", r"k_{c} d^{3/2} = k_{l} d^{2}."),
        ("sum_i theta_i - integral(phi)", r"\sum_i \theta_{i} - \int (\phi)"),
    ],
)  # fmt: skip
def test_plain_text_becomes_latex(plain, latex):
    def squeezed(text):
        return text.replace(" ", "")

    assert squeezed(formulas.to_latex(plain)) == squeezed(latex)
