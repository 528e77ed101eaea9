"""How a part of a kernel is compiled: into the kernel that calls it, and nowhere else.

Numba optimises each function and makes machine code of it by itself before it is linked into its callers, where it is
optimised again.  A kernel has more than a hundred parts that nothing but the kernel calls; done once, with the kernel,
the same machine code takes half the time to compile.
"""

from __future__ import annotations

from typing import Any

__all__ = ["pipeline"]


_IDLE = frozenset({"inline_inlinables", "inline_overloads", "nopython_rewrites", "with_lifting"})
"""Passes for array expressions, for blocks with a context and for functions that are inlined as source."""


class _Nobody:
    """Of what a code generator is asked for about a part: nothing, since a part is never called by itself."""

    def set_env(self, name: str, env: Any) -> None:
        """Nowhere to put it."""


def pipeline() -> dict[str, Any]:
    """The option of ``njit`` that compiles a function as a part; none where Numba has been built otherwise."""
    try:
        from llvmlite.binding import Linkage
        from numba.core.codegen import JITCodeLibrary
        from numba.core.compiler import Compiler
    except ImportError:  # a Numba that has moved them
        return {}
    for name in ("finalize", "_get_module_for_linking", "_finalize_dynamic_globals", "codegen"):
        if not hasattr(JITCodeLibrary, name):
            return {}

    class Part(JITCodeLibrary):
        """Code that waits to be linked into the code that calls it."""

        _shared_module: Any = None

        @property
        def codegen(self) -> Any:
            return _Nobody()

        def _optimize_functions(self, module: Any) -> None:
            module.data_layout = self._codegen._data_layout

        def finalize(self) -> None:
            """Nothing is linked in here: a part of parts would carry all of them, and its callers again."""
            self._raise_if_finalized()
            for library in self._linking_libraries:
                self._reload_init.update(library._reload_init)
            self._finalize_dynamic_globals()
            for function in self._final_module.functions:
                if not function.is_declaration and function.linkage == Linkage.external:
                    function.linkage = "linkonce_odr"
            self._finalized = True

        def _below(self) -> list[Any]:
            """All that the part calls, each after one that calls it, since a linker drops what nobody asks for."""
            found: dict[Any, None] = {}
            waiting = list(reversed(self._linking_libraries))
            while waiting:
                library = waiting.pop()
                if library not in found:
                    found[library] = None
                    if isinstance(library, Part):
                        waiting += reversed(library._linking_libraries)
            return list(found)

        def _get_module_for_linking(self) -> Any:
            """The part with all that it calls, for code that is not a part itself."""
            self._ensure_finalized()
            if self._shared_module is None:
                whole = self._final_module.clone()
                for library in self._below():
                    library._ensure_finalized()
                    own = (
                        library._final_module
                        if isinstance(library, Part)
                        else library._get_module_for_linking()
                    )
                    whole.link_in(own, preserve=True)
                self._shared_module = whole
            return self._shared_module

        def get_pointer_to_function(self, name: str) -> int:
            self._ensure_finalized()
            return 0

    class PartCompiler(Compiler):
        """Numba's own, with the library above, and without the passes that find nothing to do in a part."""

        def define_pipelines(self) -> Any:
            managers = super().define_pipelines()
            for manager in managers:
                manager.passes = [each for each in manager.passes if each[0].name() not in _IDLE]
                manager.finalize()
            return managers

        def _compile_core(self) -> Any:
            state = self.state
            if state.library is None:
                state.library = Part(state.targetctx.codegen(), state.func_id.func_qualname)
            return super()._compile_core()

    return {"pipeline_class": PartCompiler}
