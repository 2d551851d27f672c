"""Studies: many points of one scenario, on the cores of this machine or of a cluster."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _command, _native
from ._errors import BusyError
from .scenario import Scenario, path_of

if TYPE_CHECKING:
    import distributed
    import pandas

#: Chunks of points for each worker of a cluster: enough that all end at about the same time.
_CHUNKS = 8
#: How long a chunk waits for a process that still works on it (s): one that a cluster has given up.
_PATIENCE = 60.0


def load_study(source: str | os.PathLike[str] | Mapping[str, Any], name: str = "study") -> Study:
    """Reads a study: the path of a study file, or its content as a dict.

    In a dict, `scenario` may be the name of a scenario that ships with the package. Paths are relative to the working
    directory, and `name` is that of the study.
    """
    if not isinstance(source, Mapping):
        return Study(_native.Study.load(Path(source)))
    content = json.loads(json.dumps(source))
    content["scenario"] = str(path_of(content.get("scenario", "")).absolute())
    design = content.get("design", {})
    if "file" in design:
        design["file"] = str(Path(design["file"]).absolute())
    return Study(_native.Study.parse(json.dumps(content), Path(f"{name}.json")))


class Study:
    """Many points of one scenario: combinations of the values of factors. `load_study` makes one. It can be pickled."""

    def __init__(self, native: _native.Study) -> None:
        self._native = native

    @property
    def name(self) -> str:
        """Name of the study."""
        return self._native.name

    @property
    def content(self) -> dict[str, Any]:
        """The study as in its file, completed by defaults."""
        content: dict[str, Any] = json.loads(self._native.json())
        return content

    @property
    def factors(self) -> list[str]:
        """Names of the factors."""
        return self._native.factors

    @property
    def metrics(self) -> list[str]:
        """Names of the figures: the objectives and limits."""
        return self._native.metrics

    def __len__(self) -> int:
        return self._native.count

    def __getitem__(self, number: int) -> dict[str, Any]:
        """The values of a point, counted from 1, by factor."""
        return dict(zip(self.factors, self._native.point(number)))

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """The values of all points."""
        return (self[number] for number in range(1, len(self) + 1))

    def choose(self) -> dict[str, Any] | None:
        """The step of all points and how it was chosen, if the scenario has the key `accuracy`. Computing points does this."""
        chosen = self._native.choose()
        return None if chosen is None else dict(json.loads(chosen))

    def scenario(self, number: int) -> Scenario:
        """The scenario of a point, to run it alone."""
        return Scenario(self._native.scenario(number))

    def compute(self, number: int) -> dict[str, Any]:
        """Computes a point in this process, and returns its status and figures. A point that fails has that status."""
        row = json.loads(self._native.compute(number))
        figures = dict(zip(self.metrics, row["metrics"] or [None] * len(self.metrics)))
        return {"status": row["status"], "reached": row["reached"], "message": row.get("message", "")} | figures

    def run(
        self,
        client: distributed.Client | None = None,
        *,
        folder: str | os.PathLike[str] | None = None,
        workers: int | None = None,
        retry: bool = False,
        progress: Callable[[int, int], object] | None = None,
    ) -> StudyResults:
        """Computes the points that are not in the folder yet, and writes its results, as `maglev study run` does.

        Without a client, `workers` processes of this machine compute them, by default one for each core. With a client of
        Dask, the workers of its cluster do; they must see the folder, the scenario and the units under the same paths. The
        results are the same to the byte, for any number of workers, and whatever is killed on the way: the same call
        continues. The folder is `results/` and the name of the study by default. `retry` computes failed points again.
        `progress` is called with the number of points that are done and of those to do.
        """
        place = Path(folder or Path("results") / self.name).absolute()
        if client is None:
            cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
            counts = self._native.run(place, _command.PROGRAM, (workers or cores or 1, None, retry), progress)[2]
            return StudyResults(place, *(counts or ()))
        if workers is not None:
            raise ValueError("the cluster of the client has its own number of workers")
        self._spread(client, place, retry, progress)
        return StudyResults(place, *_native.merge_study(place, []))

    def _spread(self, client: distributed.Client, folder: Path, retry: bool, progress: Callable[[int, int], object] | None) -> None:
        """Lets the workers of a cluster compute chunks of the points."""
        from distributed import as_completed

        at_work = sum(client.nthreads().values()) or 1
        size = max(1, -(-len(self) // (_CHUNKS * at_work)))
        spans = [(first, min(first + size - 1, len(self))) for first in range(1, len(self) + 1, size)]
        # once here, not by each worker
        task = (self._native.json(), str(self._native.path), str(folder), retry, self._native.choose())
        futures = client.map(_chunk, spans, [task] * len(spans), pure=False)
        try:
            done = 0
            for future in as_completed(futures):
                done += future.result()
                if progress is not None:
                    progress(done, len(self))
        finally:
            client.cancel(futures)

    def __repr__(self) -> str:
        return f"<Study {self.name}: {len(self)} points of {', '.join(self.factors)}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickled, (self._native.json(), self._native.path)


def _unpickled(text: str, path: Path) -> Study:
    return Study(_native.Study.parse(text, path))


def _chunk(span: tuple[int, int], task: tuple[str, str, str, bool, str | None]) -> int:
    """Computes points on a worker of a cluster, in a process of the command; returns their number.

    A chunk of a worker that was lost is computed again by another one, which continues with the points that are missing.
    """
    text, path, folder, retry, chosen = task
    study = _native.Study.parse(text, path)
    if chosen is not None:
        study.adopt(chosen)
    begin = time.monotonic()
    while True:
        try:
            return study.run(folder, _command.PROGRAM, (1, span, retry))[1]
        except BusyError:
            if time.monotonic() - begin > _PATIENCE:
                raise
            time.sleep(1)


@dataclass(frozen=True)
class StudyResults:
    """The results folder of a study."""

    folder: Path
    #: Number of points of the study
    points: int = 0
    #: Of these, the ones that are computed
    done: int = 0
    #: Of these, the ones that failed
    failed: int = 0
    #: Of these, the ones that exceed a limit
    beyond: int = 0

    @property
    def dataset(self) -> Path:
        """The Parquet dataset, in hive layout: `polars.read_parquet(results.dataset)`, `pyarrow.dataset.dataset(...)`."""
        return self.folder / "dataset"

    def to_pandas(self) -> pandas.DataFrame:
        """The table of points as a data frame: factors, status, figures."""
        import pandas

        return pandas.read_csv(self.folder / "metrics.csv", index_col="point")

    def _repr_html_(self) -> str:
        head = f"<p>{self.done} of {self.points} points, {self.failed} failed, {self.beyond} beyond a limit: {self.folder}</p>"
        return head + str(self.to_pandas().to_html(max_rows=20))
