"""Eight double-precision numbers side by side, as one value inside compiled code.

The modes of a model are marched eight at a time.  Numba's automatic vectoriser gives no guarantee that
a loop over modes becomes vector instructions, and permitting it to reorder sums would make results
depend on the processor.  Here both are explicit: a :class:`Lanes` value is one vector register
(or two, or four, where the processor's registers are narrower), an addition of two of them is eight
additions, and a sum over lanes has a fixed order.  The arithmetic is therefore the same on every
processor that rounds a fused multiply-add once, whatever its register width.

Functions written with ``+``, ``-`` and ``*`` alone take lanes and plain floats alike, which is how
:mod:`snapbeam.engines.scalar.physics` serves every engine with one text.
"""

from __future__ import annotations

import math
import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, overload, register_model

from snapbeam.engines.scalar.compile import INLINE_HERE, overloaded

__all__ = [
    "WIDTH",
    "fma",
    "lanes_sum",
    "load",
    "move",
    "select_less",
    "splat",
    "broadcast_load",
    "store",
    "vabs",
    "vfloor",
    "vtrunc",
]

WIDTH = 8

_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, WIDTH)
_I32 = ir.IntType(32)
_INTRINSIC = f"v{WIDTH}f64"


class Lanes(types.Type):
    """The Numba type of eight doubles in one register."""

    def __init__(self) -> None:
        super().__init__(name=f"lanes{WIDTH}")


LANES = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _VECTOR)


def _splat(builder: Any, value: Any) -> Any:
    undefined = ir.Constant(_VECTOR, ir.Undefined)
    one = builder.insert_element(undefined, value, ir.Constant(_I32, 0))
    mask = ir.Constant(ir.VectorType(_I32, WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, undefined, mask)


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, index: Any) -> Any:
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


@intrinsic
def load(typingctx: Any, array: Any, index: Any) -> Any:
    """``array[index : index + 8]`` of a contiguous one-dimensional float64 array, unchecked."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load(_pointer(context, builder, signature.args[0], args[0], args[1]), align=8)

    return LANES(array, types.intp), codegen


@intrinsic
def broadcast_load(typingctx: Any, array: Any, index: Any) -> Any:
    """``array[index]`` in every lane, unchecked."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        return _splat(builder, builder.load(builder.gep(data, [args[1]])))

    return LANES(array, types.intp), codegen


@intrinsic
def store(typingctx: Any, array: Any, index: Any, value: Any) -> Any:
    """``array[index : index + 8] = value``, unchecked."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = _pointer(context, builder, signature.args[0], args[0], args[1])
        builder.store(args[2], pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, LANES), codegen


@intrinsic
def move(typingctx: Any, array: Any, to: Any, origin: Any) -> Any:
    """``array[to] = array[origin]``, unchecked."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, args[0]).data
        builder.store(builder.load(builder.gep(data, [args[2]])), builder.gep(data, [args[1]]))
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp), codegen


@intrinsic
def splat(typingctx: Any, value: Any) -> Any:
    """The same number in every lane."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _splat(builder, args[0])

    return LANES(types.float64), codegen


def kinds_of(*kinds: Any) -> list[Any]:
    """The types that lanes and numbers beside them are taken as: lanes, and doubles that go into every lane."""
    return [kind if isinstance(kind, Lanes) else types.float64 for kind in kinds]


def wide(builder: Any, signature: Any, args: Any) -> list[Any]:
    """Arguments as registers, numbers among them in every lane."""
    return [
        value if isinstance(kind, Lanes) else _splat(builder, value)
        for kind, value in zip(signature.args, args, strict=True)
    ]


@intrinsic
def _lanes_fma(typingctx: Any, a: Any, b: Any, c: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fma.{_INTRINSIC}")
        return builder.call(function, wide(builder, signature, args))

    return LANES(*kinds_of(a, b, c)), codegen


@intrinsic
def _scalar_fma(typingctx: Any, a: Any, b: Any, c: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(_DOUBLE, [_DOUBLE] * 3)
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.fma.f64")
        return builder.call(function, args)

    return types.float64(types.float64, types.float64, types.float64), codegen


def fma(a: Any, b: Any, c: Any) -> Any:
    """``a*b + c``, rounded once; for lanes and floats (a float beside lanes is spread over them)."""
    return a * b + c


def _is_lanes(kind: Any) -> bool:
    return isinstance(kind, Lanes)


@overloaded(fma)
def _fma(a, b, c):
    if any(map(_is_lanes, (a, b, c))):
        return lambda a, b, c: _lanes_fma(a, b, c)
    return lambda a, b, c: _scalar_fma(a, b, c)


def select_less(a: Any, b: Any, yes: Any, no: Any) -> Any:
    """*yes* where ``a < b``, else *no*; lane by lane, or for floats."""
    return yes if a < b else no


@overloaded(select_less)
def _select_less(a, b, yes, no):
    if any(map(_is_lanes, (a, b, yes, no))):
        return lambda a, b, yes, no: _lanes_select(a, b, yes, no)
    return lambda a, b, yes, no: yes if a < b else no


def _unary(llvm_name: str) -> Any:
    @intrinsic
    def function(typingctx: Any, value: Any) -> Any:
        scalar = isinstance(value, types.Float)
        number, suffix = (_DOUBLE, "f64") if scalar else (_VECTOR, _INTRINSIC)

        def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            kind = ir.FunctionType(number, [number])
            callee = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{llvm_name}.{suffix}")
            return builder.call(callee, args)

        return value(value), codegen

    return function


vfloor = _unary("floor")
vabs = _unary("fabs")
vtrunc = _unary("trunc")
_vsqrt = _unary("sqrt")


@overload(abs, jit_options=INLINE_HERE)
def _abs(value):
    if _is_lanes(value):
        return lambda value: vabs(value)
    return None


@overload(math.sqrt, jit_options=INLINE_HERE)
def _sqrt(value):
    if _is_lanes(value):
        return lambda value: _vsqrt(value)
    return None


@intrinsic
def _lanes_select(typingctx: Any, a: Any, b: Any, yes: Any, no: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        low, high, if_less, otherwise = wide(builder, signature, args)
        return builder.select(builder.fcmp_ordered("<", low, high), if_less, otherwise)

    return LANES(*kinds_of(a, b, yes, no)), codegen


@intrinsic
def lanes_sum(typingctx: Any, value: Any) -> Any:
    """The sum of the eight lanes, always in the same order: halves, quarters, pairs."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        total, width = args[0], WIDTH
        while width > 1:
            width //= 2
            undefined = ir.Constant(ir.VectorType(_DOUBLE, 2 * width), ir.Undefined)
            kind = ir.VectorType(_I32, width)
            low = builder.shuffle_vector(total, undefined, ir.Constant(kind, list(range(width))))
            high = builder.shuffle_vector(total, undefined, ir.Constant(kind, list(range(width, 2 * width))))
            total = builder.fadd(low, high)
        return builder.extract_element(total, ir.Constant(_I32, 0))

    return types.float64(LANES), codegen


def _arithmetic(python_operator: Any, llvm_name: str) -> None:
    """An operation on lanes, or on lanes and numbers, as one instruction: no function is compiled for it."""
    pairs = ((LANES, LANES), (LANES, types.float64), (types.float64, LANES))

    @infer_global(python_operator)
    class _Operation(ConcreteTemplate):
        cases = [signature(LANES, *pair) for pair in pairs]  # noqa: RUF012

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return getattr(builder, llvm_name)(*wide(builder, signature, args))

    for pair in pairs:
        lower_builtin(python_operator, *pair)(codegen)


for _operator, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _arithmetic(_operator, _name)
