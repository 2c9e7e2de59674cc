"""Many models at once: verify suspects, or sign copies, on all cores of one machine or on a cluster.

A table of jobs goes in, a folder of Parquet comes out, with a row for each job. What runs them is Daft (`pip install "sigmark[batch]"`): on this machine without a server, or on a
cluster of Ray by `engine="ray"`. Places are paths, or what pyarrow has file systems for: `s3://…`, `gs://…`.

- A file that can't be worked on costs its own row, which says why in the column `error`; so does one that takes down the process that works on it.
- A run that was killed is taken up by the same call: what is finished is kept in `_ledger` beside the results, row by row, until all is there. A worker that was killed repeats the row
  that it worked on, and no other; the next call tries rows that have an error again.
- The rows are those of `engine="serial"`, on any number of workers.

`python -m sigmark.batch --help` is the same as a command.
"""

from ._run import Summary, embed, verify

__all__ = ["Summary", "embed", "verify"]
