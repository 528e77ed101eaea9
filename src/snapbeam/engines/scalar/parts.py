"""How a part of a kernel is compiled: into the kernel that calls it, and nowhere else.

Numba optimises each function and makes machine code of it by itself before it is linked into its callers, where it is
optimised again.  A kernel has more than a hundred parts that nothing but the kernel calls; done once, with the kernel,
the same machine code takes half the time to compile.
"""

from __future__ import annotations

from typing import Any

__all__ = ["pipeline"]


class _Nobody:
    """Of what a code generator is asked for about a part: nothing, since a part is never called by itself."""

    def set_env(self, name: str, env: Any) -> None:
        """Nowhere to put it."""


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

    class PartCompiler(Compiler):
        """Numba's own, with the library above."""

        def _compile_core(self) -> Any:
            state = self.state
            if state.library is None:
                state.library = Part(state.targetctx.codegen(), state.func_id.func_qualname)
            return super()._compile_core()

    return {"pipeline_class": PartCompiler}
