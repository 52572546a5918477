"""Eight numbers in a vector register, as a type of Numba with the few operations that the kernels need.

LLVM's own vectorisers give up on these loops: they are short, and nothing tells that input and output do not overlap.
Every operation rounds once, also the signs ``+ - * /``, between lanes or lanes and a number; ``step`` and ``minus`` are
there for products and sums in one. Nothing is left for LLVM to fuse as it likes: it would not do so everywhere alike.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, overload, register_model

LANES = 8

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)


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


def _fused(negated: bool, *kinds: Any) -> Any:
    """Return the generator of x * u + y, or y - x * u, with one rounding; of lanes or of numbers."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        wide = isinstance(signature.return_type, _Lanes)
        args = [_everywhere(builder, v) if wide and v.type == ir.DoubleType() else v for v in args]
        if negated:
            args[0] = builder.fneg(args[0])
        kind, name = args[0].type, f"llvm.fma.v{LANES}f64" if wide else "llvm.fma.f64"
        module = builder.module
        called = module.globals.get(name) or ir.Function(module, ir.FunctionType(kind, [kind] * 3), name)
        return builder.call(called, args)

    return (lanes if any(isinstance(k, _Lanes) for k in kinds) else types.float64)(*kinds), generate


@intrinsic
def step(typing: Any, x: Any, u: Any, y: Any) -> Any:
    """Return x * u + y, rounded once; each is lanes or a number."""
    return _fused(False, x, u, y)


@intrinsic
def minus(typing: Any, x: Any, u: Any, y: Any) -> Any:
    """Return y - x * u, rounded once; each is lanes or a number."""
    return _fused(True, x, u, y)


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


@intrinsic
def added(typing: Any, x: Any) -> Any:
    """Return the sum of the LANES numbers, by halves."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        x = args[0]
        for half in (4, 2, 1):
            indices = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [(r + half) % LANES for r in range(LANES)])
            x = builder.fadd(x, builder.shuffle_vector(x, x, indices))
        return builder.extract_element(x, ir.Constant(ir.IntType(32), 0))

    return types.float64(lanes), generate


def _sign(symbol: Any, instruction: str) -> None:
    """Let a sign of Python stand for an instruction between lanes, or lanes and a number."""

    @intrinsic
    def operation(typing: Any, x: Any, y: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            pair = [_everywhere(builder, v) if v.type == ir.DoubleType() else v for v in args]
            return getattr(builder, instruction)(*pair)

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
