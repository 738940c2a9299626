"""What the benchmarks take from tests is there: nobody runs them at every change."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_what_is_imported_from_tests_is_defined_there() -> None:
    homes = {
        path.stem: path for folder in ("catalogue", "integrate", ".") for path in (ROOT / "tests" / folder).glob("*.py")
    }
    looked = 0
    for benchmark in (ROOT / "benchmarks").glob("*.py"):
        for node in ast.walk(ast.parse(benchmark.read_text())):
            if not isinstance(node, ast.ImportFrom) or node.module not in homes:
                continue
            defined = set()
            for item in ast.parse(homes[node.module].read_text()).body:
                if isinstance(item, ast.FunctionDef | ast.ClassDef):
                    defined.add(item.name)
                elif isinstance(item, ast.Assign | ast.AnnAssign):
                    targets = item.targets if isinstance(item, ast.Assign) else [item.target]
                    defined |= {
                        name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)
                    }
            missing = {alias.name for alias in node.names} - defined
            assert not missing, (benchmark.name, node.module, missing)
            looked += 1
    assert looked
