"""Neighbouring voxels of a row read at once: half or a quarter of the loads, which is what sampling costs."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def _floats(context: Any, builder: Any, array_type: Any, array: Any, index: Any, count: int) -> Any:
    """`count` float32 from `index` on, from loads of 32 or 64 bits where the voxels are narrower than that."""
    voxel = array_type.dtype
    data = cgutils.create_struct_proxy(array_type)(context, builder, value=array).data
    bits = voxel.bitwidth
    out = []
    if bits * 2 > 64:
        for i in range(count):
            pointer = builder.gep(data, [builder.add(index, ir.Constant(index.type, i))])
            out.append(context.cast(builder, builder.load(pointer), voxel, types.float32))
        return out
    together = min(count, 64 // bits)
    wide = ir.IntType(together * bits)
    for start in range(0, count, together):
        pointer = builder.gep(data, [builder.add(index, ir.Constant(index.type, start))])
        word = builder.load(builder.bitcast(pointer, wide.as_pointer()), align=bits // 8)
        for i in range(together):
            part = builder.trunc(builder.lshr(word, ir.Constant(wide, i * bits)), ir.IntType(bits))
            if isinstance(voxel, types.Float):
                out.append(builder.bitcast(part, ir.FloatType()))
            elif voxel.signed:
                out.append(builder.sitofp(part, ir.FloatType()))
            else:
                out.append(builder.uitofp(part, ir.FloatType()))
    return out


def _reader(count: int) -> Any:
    @intrinsic  # type: ignore[untyped-decorator]
    def read(typing: Any, voxels: Any, index: Any) -> Any:
        result = types.UniTuple(types.float32, count)

        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array, start = args
            return context.make_tuple(builder, result, _floats(context, builder, signature.args[0], array, start, count))

        return result(voxels, index), code

    return read


# pair(voxels, i) = float32 of voxels[i], voxels[i + 1]; quad: of four. Voxels flat and little-endian.
pair = _reader(2)
quad = _reader(4)
