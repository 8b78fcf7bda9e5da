"""`a7sim console --browser`: the console on a page of this machine, which fetches nothing from other servers."""

import asyncio
import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import urllib.error
import urllib.request
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import aiohttp
import pytest

from tests.conftest import Typed
from tests.support.processes import COMMAND
from tests.support.server_thread import TIMEOUT_S

LONG_S = 3.0 * TIMEOUT_S
"""A console is a separate process, which starts and ends slowly on a busy machine."""

FETCHED = re.compile(r"""(?:src|href)=["']?([^"'> ]+)|url\(["']?([^"')]+)|@import ["']?([^"';]+)""")


@contextlib.contextmanager
def serving(*words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Serve the console of Akwanga at a free port; yield the process and the address that it prints."""
    command = [*COMMAND, "console", "akwanga", "--seed", "7", "--browser", "--port", "0", *words]
    with tempfile.TemporaryDirectory() as data:
        environment = {**os.environ, "XDG_DATA_HOME": data}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        process = subprocess.Popen(command, **pipes, text=True, env=environment)
        try:
            yield process, _printed_address(process)
        finally:
            process.kill()
            process.communicate()


def _printed_address(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None and process.stderr is not None
    line = process.stdout.readline()
    assert line.startswith("http://127.0.0.1:"), line + process.stderr.read()
    return line.split()[0]


@contextlib.asynccontextmanager
async def page_of(address: str) -> AsyncIterator[aiohttp.ClientWebSocketResponse]:
    """Open the web socket that a page opens to its console."""
    async with aiohttp.ClientSession() as browser, browser.ws_connect(f"{address}ws?width=100&height=30") as page:
        yield page


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with serving() as (_, url):
        yield url


def fetch(url: str, **headers: str) -> tuple[str, str]:
    """Return the text at an address and its content security policy."""
    with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=TIMEOUT_S) as answer:
        return answer.read().decode("utf-8", "replace"), answer.headers["Content-Security-Policy"]


def test_the_page_fetches_only_from_its_server(address: str) -> None:
    waiting, seen = [""], set()
    while waiting:
        place = waiting.pop()
        if place in seen or place.startswith("data:"):
            continue
        seen.add(place)
        text, policy = fetch(address + place)
        assert "default-src 'none'" in policy and "http" not in policy
        without_comments = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        if not place.endswith(".ttf"):
            assert not re.findall(r"https?:/|[\"'(]//[a-z]", without_comments), place
        if place == "" or place.endswith(".css"):
            waiting += [next(filter(None, found)) for found in FETCHED.findall(without_comments)]
    assert {"static/js/textual.js", "static/css/xterm.css", "static/fonts/RobotoMono-VariableFont_wght.ttf"} <= seen


def test_a_page_shows_the_console_and_its_keys_work(address: str) -> None:
    async def visit() -> None:
        async with asyncio.timeout(LONG_S), page_of(address) as page:

            async def until(words: str) -> None:
                screen = b""
                while words.encode() not in screen:
                    message = await page.receive()
                    assert message.type is aiohttp.WSMsgType.BINARY, f"{words} is not on\n{screen!r}"
                    screen += message.data

            await until("l lays pictures")
            await page.send_json(["stdin", "]"])
            await until("step 10")
            await page.send_json(["stdin", "q"])
            while not page.closed:
                await page.receive()

    asyncio.run(visit())


@pytest.mark.parametrize(
    "headers", [{"Origin": "http://elsewhere.example"}, {"Host": "elsewhere.example"}, {"Origin": "null"}]
)
def test_a_page_of_another_site_is_refused(address: str, headers: dict[str, str]) -> None:
    with pytest.raises(urllib.error.HTTPError) as refused:
        fetch(f"{address}ws", **headers)
    assert refused.value.code == 403


def test_the_server_ends_after_its_idle_time_without_a_browser() -> None:
    with serving("--idle-exit", "0.005") as (process, _):
        printed, errors = process.communicate(timeout=LONG_S)
        assert (process.returncode, printed, errors) == (0, "no browser for 0.005 min: ended\n", "")


def test_an_open_page_keeps_the_server_running_and_a_signal_ends_both() -> None:
    with serving("--idle-exit", "0.03") as (process, url):

        async def visit() -> None:
            async with asyncio.timeout(LONG_S), page_of(url) as page:
                assert (await page.receive()).type is aiohttp.WSMsgType.BINARY
                await asyncio.sleep(1.9)
                assert process.poll() is None, "1.8 s without a browser would have ended it"
                process.send_signal(signal.SIGTERM)
                while not page.closed:
                    await page.receive()

        asyncio.run(visit())
        _, errors = process.communicate(timeout=LONG_S)
        assert (process.returncode, errors) == (0, "")


def test_a_console_that_cannot_be_served_is_reported_in_one_sentence(
    typed: Typed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, _, message = typed("console", "--browser", "--port", port)
        assert code == 2 and message == f"a7sim: --port {port}: expected a port that is free: Address already in use\n"
    code, _, message = typed("console", "--port", "0")
    assert (code, message) == (2, "a7sim: --port: expected --browser beside it\n")
    assert typed("console", "nowhere", "--browser")[0] == 2, "a mistake is found before anything is served"
    monkeypatch.setitem(sys.modules, "a7sim.console.browser", None)
    code, _, message = typed("console", "--browser")
    assert code == 2 and message.endswith("expected textual-serve to be installed: pip install 'a7sim[browser]'\n")
