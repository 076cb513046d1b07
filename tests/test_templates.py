"""Templates format short texts; what reads the same in every generated module is plain Python beside them."""

import ast
import re
from pathlib import Path

import pytest

from derive import emit, plants
from wheelpend.kernels.load import real_time_text

ROOT = Path(__file__).parent.parent
CORE = sorted(p for p in (ROOT / "templates" / "core").glob("*.py") if p.stem not in ("__init__", "frame"))
GENERATED = [(ROOT / "generated" / f"wheel_pendulum{kind}.py").read_text(encoding="utf-8") for kind in ("", "_library")]
GENERATED.append(real_time_text("wheel_pendulum", plants.complete_assumptions("wheel_pendulum", {}), ["coulomb_drive"]))


def functions(tree):
    return {f.name: f for f in tree.body if isinstance(f, ast.FunctionDef)}


def assigned(tree):
    targets = [t for s in tree.body if isinstance(s, ast.Assign) for target in s.targets for t in ast.walk(target)]
    return {t.id for t in targets if isinstance(t, ast.Name)}


@pytest.mark.parametrize("template", sorted((ROOT / "templates").glob("*.j2")), ids=lambda p: p.name)
def test_a_template_is_read_at_a_glance(template):
    assert len(template.read_text(encoding="utf-8").splitlines()) <= 110


@pytest.mark.parametrize("template", sorted((ROOT / "templates").glob("*.j2")), ids=lambda p: p.name)
def test_a_function_in_a_template_needs_template_language(template):
    for function in re.split(r"^@", template.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        assert "{{" in function or "{%" in function, function.splitlines()[1]


@pytest.mark.parametrize("file", CORE, ids=lambda p: p.stem)
def test_a_core_file_has_no_template_language_and_stands_verbatim_in_a_generated_module(file):
    text = file.read_text(encoding="utf-8")
    assert not [mark for mark in ("{{", "{%", "{#") if mark in text]
    lines = text.splitlines()
    for function in functions(ast.parse(text)).values():
        own = "\n".join(lines[function.decorator_list[0].lineno - 1 : function.end_lineno])
        assert any(f"\n\n\n{own}\n" in module for module in GENERATED), function.name


def test_core_files_take_only_names_that_a_generated_module_has():
    frame = ast.parse((ROOT / "templates" / "core" / "frame.py").read_text(encoding="utf-8"))
    modules = [ast.parse(text) for text in GENERATED]
    assert assigned(frame) - {"Function"} <= set().union(*map(assigned, modules))
    for name, stated in functions(frame).items():
        written = [functions(m)[name] for m in modules if name in functions(m)]
        assert name == "compiled" or len(stated.args.args) in [len(f.args.args) for f in written], name


def test_a_template_that_asks_for_an_unknown_function_is_told_the_known_ones():
    with pytest.raises(KeyError, match="has no function '_skid'; it has _slip"):
        emit.core("friction", "_skid")
