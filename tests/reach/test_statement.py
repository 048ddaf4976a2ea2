"""A kind with fields, made into prose only where it is shown."""

from __future__ import annotations

import pytest

from modegraph.reach.statement import Kind, Statement, remedies, texts, told


def counted(count: int, of: str = "parts") -> str:
    return f"{count} {of}"


class Fruit(Kind):
    RIPE = "{name} is ripe", "eat it"
    MANY = counted, "eat them"
    SPEAKS = "{text}", "{text}"


def test_templates_and_functions_make_the_text() -> None:
    assert str(Statement(Fruit.RIPE, name="the plum")) == "the plum is ripe"
    assert str(Statement(Fruit.MANY, count=2)) == "2 parts"
    assert Statement(Fruit.MANY, count=2, of="plums").data() == {"kind": "many", "count": 2, "of": "plums"}


def test_wrong_fields_are_an_error_at_once() -> None:
    with pytest.raises(TypeError, match=r"RIPE has the fields \['name'\]"):
        Statement(Fruit.RIPE)
    with pytest.raises(TypeError, match="colour"):
        Statement(Fruit.MANY, count=1, colour="red")


def test_what_would_help_is_said_once_and_last() -> None:
    plum, pear = (Statement(Fruit.RIPE, name=name) for name in "ab")
    own = Statement(Fruit.SPEAKS, text="c")
    assert texts([plum, pear, own]) == "a is ripe; b is ripe; c"
    assert remedies([plum, pear, own]) == "eat it"
    assert told([plum, own, pear]) == "a is ripe; c; b is ripe; eat it"
    assert told([own]) == "c"
