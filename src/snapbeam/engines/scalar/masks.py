"""Eight truth values side by side: what is asked of eight numbers at once, and which of them it is true of.

A :class:`Mask` is one bit a lane.  As a whole number (:func:`bits`) it can be kept, combined with ``&``, ``|`` and
``~`` of whole numbers, and walked through lane by lane with :func:`lowest`.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, overload, register_model

from snapbeam.engines.scalar.compile import INLINE_HERE
from snapbeam.engines.scalar.lanes import LANES, WIDTH, kinds_of, splat, wide

__all__ = [
    "ALL",
    "bits",
    "both",
    "halvings",
    "lanes_tuple",
    "less",
    "lowest",
    "mask_of",
    "pick",
    "power_of_two",
    "vmax",
    "vmin",
]

ALL = (1 << WIDTH) - 1
"""Every lane, as a whole number."""

_MASK = ir.VectorType(ir.IntType(1), WIDTH)
_I64 = ir.IntType(64)


class Mask(types.Type):
    """The Numba type of eight truth values."""

    def __init__(self) -> None:
        super().__init__(name=f"mask{WIDTH}")


MASK = Mask()


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _MASK)


@intrinsic
def less(typingctx: Any, a: Any, b: Any) -> Any:
    """Where ``a < b``; nowhere beside what is no number."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.fcmp_ordered("<", *wide(builder, signature, args))

    return MASK(*kinds_of(a, b)), codegen


@intrinsic
def bits(typingctx: Any, mask: Any) -> Any:
    """A mask as a whole number, lane 0 the lowest bit."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(WIDTH)), _I64)

    return types.int64(MASK), codegen


@intrinsic
def mask_of(typingctx: Any, which: Any) -> Any:
    """The mask that a whole number stands for."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(builder.trunc(args[0], ir.IntType(WIDTH)), _MASK)

    return MASK(types.int64), codegen


@intrinsic
def lowest(typingctx: Any, which: Any) -> Any:
    """The number of the lowest lane of some, which must not be none."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(_I64, [_I64, ir.IntType(1)])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.cttz.i64")
        return builder.call(function, [args[0], ir.Constant(ir.IntType(1), 1)])

    return types.int64(types.int64), codegen


@intrinsic
def pick(typingctx: Any, mask: Any, yes: Any, no: Any) -> Any:
    """*yes* where the mask is true, else *no*."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        chosen = wide(builder, signature.replace(args=signature.args[1:]), args[1:])
        return builder.select(args[0], *chosen)

    return LANES(MASK, *kinds_of(yes, no)), codegen


@intrinsic
def vmin(typingctx: Any, a: Any, b: Any) -> Any:
    """The lesser of two, lane by lane; the first of equal ones."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        first, second = wide(builder, signature, args)
        return builder.select(builder.fcmp_ordered("<", second, first), second, first)

    return LANES(*kinds_of(a, b)), codegen


@intrinsic
def vmax(typingctx: Any, a: Any, b: Any) -> Any:
    """The greater of two, lane by lane; the first of equal ones."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        first, second = wide(builder, signature, args)
        return builder.select(builder.fcmp_ordered("<", first, second), second, first)

    return LANES(*kinds_of(a, b)), codegen


@intrinsic
def both(typingctx: Any, a: Any, b: Any) -> Any:
    """Where both masks are true."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.and_(args[0], args[1])

    return MASK(MASK, MASK), codegen


_WHOLE = ir.VectorType(_I64, WIDTH)
_MANTISSA = (1 << 52) - 1
_EXPONENT_OF_ONE = 1023


def _all_of(value: int) -> Any:
    return ir.Constant(_WHOLE, [value] * WIDTH)


@intrinsic
def _exponent(typingctx: Any, value: Any) -> Any:
    """The exponent of positive numbers, biased, as numbers."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        whole = builder.bitcast(args[0], _WHOLE)
        return builder.sitofp(builder.lshr(whole, _all_of(52)), context.get_value_type(LANES))

    return LANES(LANES), codegen


@intrinsic
def _mantissa(typingctx: Any, value: Any) -> Any:
    """Positive numbers over the powers of two below them, in [1, 2)."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        whole = builder.and_(builder.bitcast(args[0], _WHOLE), _all_of(_MANTISSA))
        whole = builder.or_(whole, _all_of(_EXPONENT_OF_ONE << 52))
        return builder.bitcast(whole, context.get_value_type(LANES))

    return LANES(LANES), codegen


@intrinsic
def _power(typingctx: Any, value: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        whole = builder.fptosi(args[0], _WHOLE)
        whole = builder.shl(builder.add(whole, _all_of(_EXPONENT_OF_ONE)), _all_of(52))
        return builder.bitcast(whole, context.get_value_type(LANES))

    return LANES(LANES), codegen


def power_of_two(exponent: Any) -> Any:
    """Two to the power of whole numbers between -1022 and 1023, exactly."""
    raise TypeError("power_of_two runs in compiled code only")


@overload(power_of_two, jit_options=INLINE_HERE)
def _power_of_two(exponent):
    return lambda exponent: _power(exponent)


def halvings(much: Any, little: Any) -> Any:
    """How often *much* > 0 must be halved until it is at most *little* >= 0; negative: so often it may be doubled."""
    raise TypeError("halvings runs in compiled code only")


@overload(halvings, jit_options=INLINE_HERE)
def _halvings(much, little):
    def implementation(much, little):
        once = pick(less(_mantissa(little), _mantissa(much)), splat(1.0), splat(0.0))
        return _exponent(much) - _exponent(little) + once

    return implementation


@intrinsic
def lanes_tuple(typingctx: Any, template: Any, array: Any, index: Any) -> Any:
    """The named tuple that *template* is one of, its fields registers that follow each other from *index* on."""
    count = len(template)

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        data = context.make_array(signature.args[1])(context, builder, args[1]).data
        values = []
        for j in range(count):
            here = builder.add(args[2], ir.Constant(args[2].type, j * WIDTH))
            pointer = builder.bitcast(builder.gep(data, [here]), context.get_value_type(LANES).as_pointer())
            values.append(builder.load(pointer, align=8))
        return context.make_tuple(builder, signature.return_type, values)

    return types.NamedUniTuple(LANES, count, template.instance_class)(template, array, types.intp), codegen
