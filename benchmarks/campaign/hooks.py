"""What schemathesis has to be told: how a body becomes MessagePack. Loaded by its own process."""

from typing import Any

import ormsgpack
import schemathesis


@schemathesis.serializer("application/msgpack")
def _packed(context: Any, value: Any) -> bytes:
    try:
        return ormsgpack.packb(value)
    except (ormsgpack.MsgpackEncodeError, TypeError, OverflowError):
        return b"\xc1"  # it has no such form: a byte that MessagePack never uses
