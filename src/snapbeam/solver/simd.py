"""Eight double-precision numbers side by side, as one value inside compiled code.

The modes of a model are integrated eight at a time.  Numba's automatic vectoriser gives no guarantee that
a loop over modes becomes vector instructions, and permitting it to reorder sums would make results
depend on the processor.  Here both are explicit: a :class:`Lanes` value is one vector register
(or two, or four, where the processor's registers are narrower), an addition of two of them is eight
additions, and a sum over lanes has a fixed order.  The arithmetic is therefore the same on every
processor that rounds a fused multiply-add once, whatever its register width.

Functions written with ``+``, ``-`` and ``*`` alone take lanes and plain floats alike, which is how
:mod:`snapbeam.solver.physics` serves every engine with one text.
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

from snapbeam.solver.compilation import INLINE_HERE, inlined, overloaded

WIDTH = 8
ALL = (1 << WIDTH) - 1
"""Every lane, as a whole number."""
_MASK = ir.VectorType(ir.IntType(1), WIDTH)
_I64 = ir.IntType(64)

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


# Eight truth values side by side: what is asked of eight numbers at once, and which of them it is true of.
#
# A :class:`Mask` is one bit a lane.  As a whole number (:func:`bits`) it can be kept, combined with ``&``, ``|`` and
# ``~`` of whole numbers, and walked through lane by lane with :func:`lowest`.


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
    """Mask of the lanes with ``a < b``; False for NaN."""

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
    """Mask of the lanes in which both masks are True."""

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
    """Number of halvings of *much* > 0 to at most *little* >= 0; negative: number of possible doublings."""
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


@inlined
def dot(memory, size, a, b):
    """a.b over a row."""
    total = splat(0.0)
    for row in range(0, size, WIDTH):
        total = fma(load(memory, a + row), load(memory, b + row), total)
    return lanes_sum(total)
