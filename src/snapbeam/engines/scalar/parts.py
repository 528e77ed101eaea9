"""How a part of a kernel is compiled: into the kernel that calls it, and nowhere else.

Numba optimises each function and makes machine code of it by itself before it is linked into its callers, where it is
optimised again.  A kernel has more than a hundred parts that nothing but the kernel calls; done once, with the kernel,
the same machine code takes half the time to compile.  Of Numba's passes over a function those are left out that have
nothing to do in one of ours: closures, ``with``, loops over literals, array expressions, annotations for people.
"""

from __future__ import annotations

from typing import Any

__all__ = ["pipeline"]


class _Nobody:
    """Of what a code generator is asked for about a part: nothing, since a part is never called by itself."""

    def set_env(self, name: str, env: Any) -> None:
        """Nowhere to put it."""


def _lean_passes() -> Any:
    """Numba's passes that a part needs, in their order, each with its words; None if one of them is not found."""
    try:
        from numba.core import typed_passes, untyped_passes
    except ImportError:
        return None
    untyped = (
        "TranslateByteCode", "FixupArgs", "IRProcessing", "RewriteSemanticConstants", "DeadBranchPrune",
        "GenericRewrites", "ReconstructSSA", "DeadBranchPrune",
    )  # fmt: skip
    typed = (
        "NopythonTypeInference", "PreLowerStripPhis", "IRLegalization", "NativeLowering", "NoPythonBackend",
    )  # fmt: skip
    found = [getattr(untyped_passes, name, None) for name in untyped]
    found += [getattr(typed_passes, name, None) for name in typed]
    return None if None in found else found


def _manager(passes: Any, state: Any) -> Any:
    from numba.core.compiler_machinery import PassManager

    manager = PassManager("part")
    for each in passes:
        manager.add_pass(each, each.name())
    manager.finalize()
    return manager


def pipeline() -> dict[str, Any]:
    """The option of ``njit`` that compiles a function as a part; none where Numba has been built otherwise."""
    try:
        from numba.core.codegen import JITCodeLibrary
        from numba.core.compiler import Compiler
    except ImportError:  # a Numba that has moved them
        return {}
    for name in ("_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals", "codegen"):
        if not hasattr(JITCodeLibrary, name):
            return {}

    class Part(JITCodeLibrary):
        """Code that waits to be linked into the code that calls it."""

        @property
        def codegen(self) -> Any:
            return _Nobody()

        def _optimize_functions(self, module: Any) -> None:
            module.data_layout = self._codegen._data_layout

        def _optimize_final_module(self) -> None:
            """With the kernel."""

        def _finalize_final_module(self) -> None:
            self._finalize_dynamic_globals()
            self._finalized = True

        def get_pointer_to_function(self, name: str) -> int:
            self._ensure_finalized()
            return 0

    lean = _lean_passes()

    class PartCompiler(Compiler):
        """Numba's own, with the library above and fewer passes."""

        def define_pipelines(self) -> Any:
            return super().define_pipelines() if lean is None else [_manager(lean, self.state)]

        def _compile_core(self) -> Any:
            state = self.state
            if state.library is None:
                state.library = Part(state.targetctx.codegen(), state.func_id.func_qualname)
            return super()._compile_core()

    return {"pipeline_class": PartCompiler}
