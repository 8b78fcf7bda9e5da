"""Validation of a scenario: all errors together, each with its path."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import msgspec
from msgspec import inspect

Raw = Any


def schema_errors(raw: Raw, expected: inspect.Type, path: str = "") -> Iterator[str]:
    """Yield a sentence for each value of `raw` that is not of the expected type, range or name."""
    constraint, described = _unwrap(expected)
    if isinstance(constraint, inspect.StructType):
        yield from _mistakes_in_table(raw, constraint, described, path)
    elif isinstance(constraint, inspect.UnionType):
        yield from _mistakes_in_union(raw, constraint, path)
    elif isinstance(constraint, inspect.ListType | inspect.TupleType):
        yield from _mistakes_in_list(raw, constraint, described, path)
    elif isinstance(constraint, inspect.DictType):
        yield from _mistakes_in_dictionary(raw, constraint, path)
    elif not isinstance(constraint, inspect.AnyType) and not _fits(raw, constraint):
        yield f"{path}: expected {described or _in_words(constraint)}, got {_shown(raw)}"


def _unwrap(expected: inspect.Type) -> tuple[inspect.Type, str | None]:
    if isinstance(expected, inspect.Metadata):
        return expected.type, (expected.extra_json_schema or {}).get("description")
    return expected, None


def _mistakes_in_table(raw: Raw, table: inspect.StructType, described: str | None, path: str) -> Iterator[str]:
    if not isinstance(raw, Mapping):
        yield f"{path or 'the scenario'}: expected {described or 'a table'}, got {_shown(raw)}"
        return
    fields = {field.encode_name: field for field in table.fields}
    for key in raw:
        if key not in fields:
            near = get_close_matches(str(key), fields, n=1)
            known = f"a key that is known; did you mean {near[0]}?" if near else f"one of {', '.join(fields)}"
            yield f"{_join(path, key)}: expected {known}"
    for name, field in fields.items():
        if name in raw:
            yield from schema_errors(raw[name], field.type, _join(path, name))
        elif field.required:
            constraint, described = _unwrap(field.type)
            yield f"{_join(path, name)}: expected {described or _in_words(constraint)}, got nothing"


def _mistakes_in_union(raw: Raw, union: inspect.UnionType, path: str) -> Iterator[str]:
    found = [list(schema_errors(raw, each, path)) for each in union.types]
    if all(found):
        structured = [
            mistakes
            for each, mistakes in zip(union.types, found, strict=True)
            if isinstance(_unwrap(each)[0], inspect.StructType) and isinstance(raw, Mapping)
        ]
        if structured:
            yield from structured[0]
        else:
            words = [
                described or _in_words(constraint)
                for constraint, described in map(_unwrap, union.types)
                if not isinstance(constraint, inspect.NoneType)
            ]
            yield f"{path}: expected {' or '.join(words)}, got {_shown(raw)}"


def _mistakes_in_list(
    raw: Raw, expected: inspect.ListType | inspect.TupleType, described: str | None, path: str
) -> Iterator[str]:
    if not isinstance(raw, Sequence) or isinstance(raw, str):
        yield f"{path}: expected {described or _in_words(expected)}, got {_shown(raw)}"
        return
    if isinstance(expected, inspect.TupleType):
        right_length = len(raw) == len(expected.item_types)
        item_types: Sequence[inspect.Type] = expected.item_types
    else:
        right_length = (expected.min_length or 0) <= len(raw) <= (expected.max_length or len(raw))
        item_types = [expected.item_type] * len(raw)
    if not right_length:
        yield f"{path}: expected {described or _in_words(expected)}, got {len(raw)}"
    for index, (item, item_type) in enumerate(zip(raw, item_types, strict=False)):
        yield from schema_errors(item, item_type, f"{path}[{index}]")


def _mistakes_in_dictionary(raw: Raw, expected: inspect.DictType, path: str) -> Iterator[str]:
    if not isinstance(raw, Mapping):
        yield f"{path}: expected a table, got {_shown(raw)}"
        return
    for key, value in raw.items():
        yield from schema_errors(value, expected.value_type, _join(path, key))


def _fits(raw: Raw, constraint: inspect.Type) -> bool:
    match constraint:
        case inspect.LiteralType(values=values):
            return any(raw == value and type(raw) is type(value) for value in values)
        case inspect.BoolType():
            return isinstance(raw, bool)
        case inspect.NoneType():
            return raw is None
        case inspect.StrType():
            low, high = constraint.min_length or 0, constraint.max_length
            fits = isinstance(raw, str) and low <= len(raw) and (high is None or len(raw) <= high)
            return fits and (constraint.pattern is None or re.search(constraint.pattern, raw) is not None)
        case inspect.IntType() | inspect.FloatType():
            kinds = int if isinstance(constraint, inspect.IntType) else int | float
            if not isinstance(raw, kinds) or isinstance(raw, bool) or not math.isfinite(raw):
                return False
            bounds = (
                constraint.ge is None or raw >= constraint.ge,
                constraint.gt is None or raw > constraint.gt,
                constraint.le is None or raw <= constraint.le,
                constraint.lt is None or raw < constraint.lt,
            )
            return all(bounds)
    raise TypeError(f"the schema uses {constraint}, which validation does not know")


def _in_words(constraint: inspect.Type) -> str:
    match constraint:
        case inspect.LiteralType(values=values):
            return " or ".join(repr(value) for value in values)
        case inspect.TupleType(item_types=items):
            return f"a list of {len(items)} numbers"
        case inspect.UnionType(types=types):
            return " or ".join(
                described or _in_words(inner)
                for inner, described in map(_unwrap, types)
                if not isinstance(inner, inspect.NoneType)
            )
    names: dict[type[inspect.Type], str] = {
        inspect.BoolType: "true or false",
        inspect.StrType: "a text",
        inspect.IntType: "a whole number",
        inspect.FloatType: "a number",
        inspect.ListType: "a list",
        inspect.StructType: "a table",
        inspect.DictType: "a table",
    }
    return names.get(type(constraint), "nothing")


def _shown(raw: Raw) -> str:
    if isinstance(raw, Mapping):
        return "a table"
    if isinstance(raw, Sequence) and not isinstance(raw, str):
        return f"a list of {len(raw)}"
    shown = msgspec.json.encode(raw, enc_hook=str).decode() if not isinstance(raw, float) else f"{raw:g}"
    return shown if len(shown) <= 60 else shown[:57] + "..."


def _join(path: str, key: object) -> str:
    return f"{path}.{key}" if path else str(key)
