"""Eight numbers in a vector register, as a type of Numba with the few operations that the kernels need.

LLVM's own vectorisers give up on these loops: they are short, and nothing tells that input and output do not overlap.
The named operations round each on its own; the signs ``+ - * /`` may be fused, between lanes or lanes and a number.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

LANES = 8

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_FUSED = ("contract",)  # a product and a sum may become one instruction


class _Lanes(types.Type):  # type: ignore[misc]
    """The Numba type of LANES numbers in a vector register."""

    def __init__(self) -> None:
        super().__init__("Lanes")


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    """The LLVM type behind it."""

    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, _VECTOR)


lanes = _Lanes()


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, index: Any) -> Any:
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


def _everywhere(builder: Any, x: Any) -> Any:
    indices, empty = ir.VectorType(ir.IntType(32), LANES), ir.Constant(_VECTOR, ir.Undefined)
    first = builder.insert_element(empty, x, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, empty, ir.Constant(indices, [0] * LANES))


@intrinsic
def load(typing: Any, array: Any, index: Any) -> Any:
    """Return array[index : index + LANES], without checks."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = builder.load(_pointer(context, builder, signature.args[0], *args))
        value.align = 8
        return value

    return lanes(array, types.intp), generate


@intrinsic
def store(typing: Any, array: Any, index: Any, x: Any) -> Any:
    """Let array[index : index + LANES] be x, without checks."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        builder.store(args[2], _pointer(context, builder, signature.args[0], *args[:2])).align = 8
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), generate


def _operation(build: Callable[..., Any], *extra: Any) -> Any:
    """Return the generator of an operation on lanes and, in ``extra``, numbers or further lanes."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return build(builder, *(_everywhere(builder, x) if x.type == ir.DoubleType() else x for x in args))

    return lanes(lanes, *extra), generate


@intrinsic
def scaled(typing: Any, x: Any, factor: Any) -> Any:
    """Return x * factor."""
    return _operation(lambda builder, x, factor: builder.fmul(x, factor), types.float64)


@intrinsic
def plus(typing: Any, x: Any, y: Any) -> Any:
    """Return x + y."""
    return _operation(lambda builder, x, y: builder.fadd(x, y), lanes)


@intrinsic
def product(typing: Any, x: Any, y: Any) -> Any:
    """Return x * y."""
    return _operation(lambda builder, x, y: builder.fmul(x, y), lanes)


@intrinsic
def step(typing: Any, x: Any, u: Any, y: Any) -> Any:
    """Return x * u + y, rounded once where the machine can."""

    def build(builder: Any, x: Any, u: Any, y: Any) -> Any:
        return builder.fadd(builder.fmul(x, u, flags=_FUSED), y, flags=_FUSED)

    return _operation(build, types.float64, lanes)


@intrinsic
def larger(typing: Any, x: Any, y: Any) -> Any:
    """Return the larger of x and y; y where either is not a number."""
    return _operation(lambda builder, x, y: builder.select(builder.fcmp_ordered(">", x, y), x, y), lanes)


@intrinsic
def smaller(typing: Any, x: Any, y: Any) -> Any:
    """Return the smaller of x and y; y where either is not a number."""
    return _operation(lambda builder, x, y: builder.select(builder.fcmp_ordered("<", x, y), x, y), lanes)


@intrinsic
def exceeds(typing: Any, x: Any, y: Any) -> Any:
    """Return whether any of x is larger than its y, or no number."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        bits = builder.bitcast(builder.fcmp_unordered(">", *args), ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))

    return types.boolean(lanes, lanes), generate


@intrinsic
def filled(typing: Any, x: Any) -> Any:
    """Return LANES times the number x."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return _everywhere(builder, args[0])

    return lanes(types.float64), generate


@intrinsic
def root(typing: Any, x: Any) -> Any:
    """Return the square root of x."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        module = builder.module
        name = f"llvm.sqrt.v{LANES}f64"
        called = module.globals.get(name) or ir.Function(module, kind, name)
        return builder.call(called, [args[0]])

    return lanes(lanes), generate


def _sign(symbol: Any, instruction: str) -> None:
    """Let a sign of Python stand for an instruction between lanes, or lanes and a number."""

    @intrinsic
    def operation(typing: Any, x: Any, y: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            pair = [_everywhere(builder, v) if v.type == ir.DoubleType() else v for v in args]
            return getattr(builder, instruction)(*pair, flags=_FUSED)

        return lanes(x, y), generate

    @overload(symbol, strict=False)
    def between(x: Any, y: Any) -> Any:
        kinds = {type(x), type(y)}
        if _Lanes in kinds and kinds <= {_Lanes, types.Float}:
            return lambda x, y: operation(x, y)
        return None


_sign(operator.add, "fadd")
_sign(operator.sub, "fsub")
_sign(operator.mul, "fmul")
_sign(operator.truediv, "fdiv")
