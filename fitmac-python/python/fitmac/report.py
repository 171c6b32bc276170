"""Results of `fitmac eval`: episodes as records or a pandas frame, and their rates.

SR, IR and RSR are those of the paper (equation 10): successes among all episodes, episodes with a
corrective action among all, successes among those with one. Intervals are Wilson's, 95 %.
"""

from __future__ import annotations

import json
import math
import pathlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, Union

__all__ = ["Rate", "Results", "ResultsError", "Row", "read_results", "wilson"]

Path = Union[str, "PathLike[str]"]

SCHEMA = 1
"""The version of the format that is read."""

_Z = 1.959963984540054
# What is needed of a line; all other fields are kept as they are.
_FIELDS: dict[str, type] = {
    "suite": str, "task": str, "perturbation": str, "level": str, "backbone": str, "config": str,
    "profile": str, "perception": str, "knowledge": str, "seed": int, "episode": int,
    "success": bool, "intervened": bool,
}
_KEY = tuple(name for name in _FIELDS if name not in ("success", "intervened"))


class ResultsError(ValueError):
    """Not a line of results; the text names file, line and field."""


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a proportion; (0, 1) without trials."""
    if not 0 <= successes <= trials:
        raise ValueError(f"successes: {successes} of {trials} trials")
    if trials == 0:
        return 0.0, 1.0
    share, z2 = successes / trials, _Z * _Z
    middle = share + z2 / (2 * trials)
    half = _Z * math.sqrt(share * (1 - share) / trials + z2 / (4 * trials * trials))
    scale = 1 + z2 / trials
    return max(0.0, (middle - half) / scale), min(1.0, (middle + half) / scale)


@dataclass(frozen=True)
class Rate:
    """A share of episodes."""

    count: int
    of: int

    @property
    def value(self) -> float | None:
        """The share, 0 to 1; None of nothing."""
        return self.count / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval."""
        return wilson(self.count, self.of)

    def __str__(self) -> str:
        if self.of == 0:
            return "-"
        low, high = self.interval
        return f"{100 * self.count / self.of:.1f} [{100 * low:.1f}, {100 * high:.1f}]"


@dataclass(frozen=True)
class Row:
    """Episodes that share the values of some fields."""

    group: dict[str, Any]
    sr: Rate
    ir: Rate
    rsr: Rate

    def as_dict(self) -> dict[str, Any]:
        """Flat: the group's fields, counts, shares and interval ends."""
        flat = {**self.group, "episodes": self.sr.of}
        for name in ("sr", "ir", "rsr"):
            rate: Rate = getattr(self, name)
            low, high = rate.interval
            flat.update({name: rate.value, f"{name}_low": low, f"{name}_high": high})
        return flat


class Results:
    """Episodes, one dictionary each."""

    def __init__(self, records: Iterable[dict[str, Any]]) -> None:
        self.records = list(records)

    def __len__(self) -> int:
        return len(self.records)

    def where(self, **values: Any) -> Results:
        """The episodes whose fields have these values."""
        self._know(values)
        wanted = values.items()
        return Results(r for r in self.records if all(r.get(k) == v for k, v in wanted))

    def frame(self) -> Any:
        """The episodes as a pandas frame."""
        import pandas  # type: ignore[import-untyped,unused-ignore]

        return pandas.DataFrame(self.records)

    def rates(self, by: Sequence[str] = ("suite", "backbone", "perturbation", "config")) -> list[Row]:
        """SR, IR and RSR of each group, in the order of their first episode."""
        self._know(by)
        groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
        for record in self.records:
            groups.setdefault(tuple(record[name] for name in by), []).append(record)
        return [_row(dict(zip(by, key)), group) for key, group in groups.items()]

    def rates_frame(
        self, by: Sequence[str] = ("suite", "backbone", "perturbation", "config")
    ) -> Any:
        """The same as a pandas frame."""
        import pandas

        return pandas.DataFrame([row.as_dict() for row in self.rates(by)])

    def _know(self, names: Iterable[str]) -> None:
        for name in names:
            if self.records and name not in self.records[0]:
                known = ", ".join(self.records[0])
                raise ResultsError(f"episodes have no field {name!r}; they have {known}")


def _row(group: dict[str, Any], records: list[dict[str, Any]]) -> Row:
    intervened = [record for record in records if record["intervened"]]
    succeeded = sum(record["success"] for record in records)
    saved = sum(record["success"] for record in intervened)
    return Row(
        group, Rate(succeeded, len(records)), Rate(len(intervened), len(records)),
        Rate(saved, len(intervened)),
    )


def read_results(*paths: Path) -> Results:
    """Reads files of results, or folders of them (`*.jsonl`).

    An episode that stands there twice counts once; a half line at the end of a file, left by a
    run that was killed, is left out, as `fitmac eval` does. Raises ResultsError for anything
    else, FileNotFoundError where there is nothing.
    """
    records: dict[tuple[Any, ...], dict[str, Any]] = {}
    for file in _files(paths):
        text = file.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]
        for number, line in enumerate(whole.splitlines(), 1):
            record = _record(f"{file}, line {number}", line)
            records.setdefault(tuple(record[name] for name in _KEY), record)
    return Results(records.values())


def _files(paths: Sequence[Path]) -> list[pathlib.Path]:
    files: list[pathlib.Path] = []
    for path in map(pathlib.Path, paths):
        found = sorted(path.glob("*.jsonl")) if path.is_dir() else [path]
        if not found:
            raise FileNotFoundError(f"{path} has no *.jsonl: give what `fitmac eval` wrote")
        files.extend(found)
    return files


def _record(where: str, line: str) -> dict[str, Any]:
    try:
        record = json.loads(line)
    except json.JSONDecodeError as error:
        raise ResultsError(f"{where}: no JSON: {error}") from error
    if not isinstance(record, dict):
        raise ResultsError(f"{where}: no object")
    if record.get("schema") != SCHEMA:
        raise ResultsError(f"{where}: schema is {record.get('schema')!r}, read is {SCHEMA}")
    for name, kind in _FIELDS.items():
        if name not in record:
            raise ResultsError(f"{where}: {name} is missing")
        value = record[name]
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise ResultsError(f"{where}: {name} is {value!r}, not a {kind.__name__}")
    return record
