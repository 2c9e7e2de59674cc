"""The examples of the docstrings are true."""

from __future__ import annotations

import doctest
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sigmark
import sigmark._sigmark
import sigmark.shapes
from files import glb


def documented() -> list[tuple[str, str]]:
    objects = {name: getattr(sigmark, name) for name in sigmark.__all__ if name != "__version__"}
    return [("sigmark", sigmark.__doc__ or "")] + [(name, inspect.getdoc(value) or "") for name, value in objects.items()]


@pytest.mark.parametrize(("name", "text"), documented(), ids=lambda value: value if value.isidentifier() else "")
def test_examples(name: str, text: str) -> None:
    assert text, f"{name} has no docstring"
    examples = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    failures, _ = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(examples)
    assert failures == 0


def test_every_function_has_an_example() -> None:
    functions = [name for name in sigmark.__all__ if inspect.isbuiltin(getattr(sigmark, name)) and name != "read"]
    assert len(functions) >= 10
    for name in functions:
        text = inspect.getdoc(getattr(sigmark, name)) or ""
        assert ">>> " in text and "Parameters" in text, name


def test_every_method_and_property_is_documented() -> None:
    for name in sigmark.__all__:
        value = getattr(sigmark, name)
        if inspect.isclass(value):
            for member in vars(value):
                if not member.startswith("_"):
                    assert inspect.getdoc(getattr(value, member)), f"{name}.{member}"


READMES = [Path(__file__).parents[1] / "README.md", Path(__file__).parents[3] / "README.md"]


def code_of(readme: Path) -> list[str]:
    blocks = re.findall(r"```python\n(.*?)```", readme.read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    return blocks


@pytest.mark.parametrize("readme", READMES, ids=["own", "front page"])
def test_what_the_readme_shows_is_well_typed(readme: Path, tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    shown = tmp_path / "shown.py"
    shown.write_text("\n".join(code_of(readme)), encoding="utf-8")
    checked = subprocess.run([sys.executable, "-m", "mypy", "--strict", shown], cwd=tmp_path, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout


@pytest.mark.parametrize("readme", READMES, ids=["own", "front page"])
def test_what_the_readme_shows_runs(readme: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = code_of(readme)
    monkeypatch.chdir(tmp_path)
    torus = sigmark.shapes.bumpy_torus()
    Path("model.glb").write_bytes(glb(torus))
    names: dict[str, object] = {}
    for block in blocks:
        exec(block, names)
    verdict = names["verdict"]
    assert isinstance(verdict, sigmark.Verdict) and verdict.outcome == "verified"
    spectrum = names["spectrum"]
    assert isinstance(spectrum, sigmark.Spectrum) and len(spectrum) == 325
