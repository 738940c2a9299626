"""The references of the catalogue, computed anew: `python tests/catalogue/recompute.py [--write] [NAME ...]`.

Prints what differs from `regions.json`, and with --write puts the new digits there. All of them take half an hour.
Programs and places are read from the file; the mathematics is in `references`, which knows nothing of Potto.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

import mpmath as mp
from references import line, plane, space
from regions import FILE

TRUTHS = {**line.TRUTHS, **plane.TRUTHS, **space.TRUTHS}
SECONDS = {**line.SECONDS, **plane.SECONDS, **space.SECONDS}
DIGITS = 20  # that are stored; at most 12 of them are ever asked for
PRECISION = {1: 40, 2: 22}  # decimal digits to work with, by the number of variables
OTHERS = 25
COARSE = {"gyroid slab": 20, "ridge in space": 16}  # where every value takes minutes


def reference(name: str, dimensions: int, at: float) -> dict[str, str]:
    """Value, derivative and, for some, the second derivative, as texts."""
    with mp.workdps(COARSE.get(name, PRECISION.get(dimensions, OTHERS))):
        value, derivative = TRUTHS[name](mp.mpf(at))
        found = {"value": mp.nstr(value, DIGITS), "derivative": mp.nstr(derivative, DIGITS)}
        if name in SECONDS:
            found["second"] = mp.nstr(SECONDS[name](mp.mpf(at)), DIGITS)
    return found


def difference(old: dict[str, Any], new: dict[str, str]) -> float:
    """The largest relative difference; infinite where something is new."""
    if not new.keys() <= old.keys():
        return float("inf")
    return max(float(abs(mp.mpf(old[key]) - mp.mpf(text)) / max(abs(mp.mpf(text)), mp.mpf("1e-30")))
               for key, text in new.items())  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="which regions; all by default")
    parser.add_argument("--write", action="store_true", help="put the digits into the file")
    options = parser.parse_args()
    for region in json.loads(FILE.read_text(encoding="utf-8"))["regions"]:
        if options.names and region["id"] not in options.names:
            continue
        start = time.perf_counter()
        new = reference(region["id"], region["dimensions"], region["at"])
        told = f"{region['id']:28} {new['value']:>24} {new['derivative']:>24}"
        off = difference(region, new)
        print(f"{told}  differs by {off:.0e}  {time.perf_counter() - start:6.1f} s", flush=True)
        if options.write:
            write(region["id"], new)


def write(name: str, new: dict[str, str]) -> None:
    """Into the file as it is now."""
    file = json.loads(FILE.read_text(encoding="utf-8"))
    next(region for region in file["regions"] if region["id"] == name).update(new)
    FILE.write_text(json.dumps(file, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
