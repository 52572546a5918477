"""An Arrow IPC stream: a row per sample, the rest of the answer as JSON in the schema's metadata."""

from collections.abc import Iterator

import numpy as np

from ..draft import Draft
from .samples import columns, matrices, rest
from .sink import Sink

#: Key of the schema's metadata that holds the answer without its samples.
KEY = "waywright"


def write(draft: Draft) -> Iterator[bytes]:
    """Write the schema, then a record batch for every piece."""
    import pyarrow

    fields = [pyarrow.field(name, pyarrow.float64(), nullable=False) for name in columns(draft)]
    schema = pyarrow.schema(fields, metadata={KEY: rest(draft, "samples")})
    sink = Sink()
    with pyarrow.ipc.new_stream(pyarrow.PythonFile(sink, "w"), schema) as stream:
        for matrix in matrices(draft):
            arrays = [pyarrow.array(column) for column in np.ascontiguousarray(matrix.T)]
            stream.write_batch(pyarrow.record_batch(arrays, schema=schema))
            yield sink.take()
    yield sink.take()
