"""The examples of the docstrings are true."""

from __future__ import annotations

import doctest
import inspect

import pytest

import sigmark
import sigmark._sigmark


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
