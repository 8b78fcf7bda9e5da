"""The observation book printed in the tutorial is that of its keys (issue 10)."""

import asyncio
import math

import pytest
from docs.make_tutorial_pictures import POINTS, afternoon, with_book

from tests.support.guide_pages import page


@pytest.mark.slow
def test_the_keys_of_the_tutorial_give_its_printed_book():
    text = page("tutorial")
    book = asyncio.run(afternoon())
    assert with_book(text, book) == text, "run python -m docs.make_tutorial_pictures"
    assert [row[0] for row in book] == list(POINTS)
    rms = math.sqrt(sum(float(row[4]) ** 2 for row in book) / len(book))
    assert f"an rms of {rms:.2f} mm" in text
