"""The package has no import circle, imports for types and imports within functions included."""

from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter

import grimp
import pytest


def circle_in(imports: Mapping[str, Iterable[str]]) -> list[str]:
    """Return the modules of one circle in a graph of imports, each imported by the next; empty without a circle."""
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_module_imports_itself_through_other_modules():
    graph = grimp.build_graph("a7sim", cache_dir=None)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert len(imports) > 300
    assert circle_in(imports) == []


def test_a_planted_circle_is_found():
    assert set(circle_in({"a": ["b"], "b": ["c"], "c": ["a"], "d": ["a"]})) == {"a", "b", "c"}
    assert circle_in({"a": ["b", "c"], "b": ["c"]}) == []


@pytest.mark.parametrize("module", ["a7sim.console.actions.base", "a7sim.instrument.language.commands.elements"])
def test_actions_and_handlers_import_an_interface_and_not_the_application(module):
    graph = grimp.build_graph("a7sim", cache_dir=None)
    imported = graph.find_modules_directly_imported_by(module)
    assert not imported & {"a7sim.console.app", "a7sim.instrument.language.engine"}
