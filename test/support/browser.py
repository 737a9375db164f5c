"""A headless Chromium for tests, driven over its debugging protocol on loopback."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import shutil
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Tuple

from tornado.websocket import WebSocketClientConnection, websocket_connect

START_TIMEOUT_S = 60.0
ANSWER_TIMEOUT_S = 60.0
CONDITION_TIMEOUT_S = 10.0
END_TIMEOUT_S = 10.0
MOST_BYTES = 64 * 1024 * 1024  # of a PDF


def chromium() -> Optional[str]:
    """Its executable, if this machine has one."""
    names = ('chromium', 'chromium-browser', 'google-chrome')
    return next((path for path in map(shutil.which, names) if path), None)


class Page:
    """One tab."""

    def __init__(self, loop: asyncio.AbstractEventLoop, socket: WebSocketClientConnection) -> None:
        self._loop, self._socket = loop, socket
        self._number = 0
        self.events: List[Dict[str, Any]] = []

    def call(self, method: str, **params: Any) -> Dict[str, Any]:
        """Result of a command; what happens meanwhile goes to `events`."""
        self._number += 1
        self._loop.run_until_complete(self._send(json.dumps({'id': self._number, 'method': method, 'params': params})))
        while True:
            message = self._next()
            if message.get('id') == self._number:
                assert 'error' not in message, message
                return message['result']

    def open(self, path: Path, width_px: int) -> None:
        """Load a file into a window of this width, and wait until it is loaded."""
        self.call(
            'Emulation.setDeviceMetricsOverride', width=width_px, height=844, deviceScaleFactor=1, mobile=width_px < 600
        )
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            self.call(f'{domain}.enable')
        self.events.clear()
        self.call('Page.navigate', url=path.resolve().as_uri())
        while not self.of_kind('Page.loadEventFired'):
            self._next()

    def evaluate(self, expression: str) -> Any:
        """Value of a JavaScript expression, promises awaited."""
        result = self.call('Runtime.evaluate', expression=expression, returnByValue=True, awaitPromise=True)
        assert 'exceptionDetails' not in result, result
        return result['result'].get('value')

    def wait_for(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""
        deadline = time.monotonic() + CONDITION_TIMEOUT_S
        while not self.evaluate(condition):
            assert time.monotonic() < deadline, condition
            time.sleep(0.02)

    def middle_of(self, element: str) -> Tuple[float, float]:
        """Scroll to an element, given as an expression; return its middle in the window."""
        self.evaluate(f'({element}).scrollIntoView({{block: "center", behavior: "instant"}})')
        box = self.evaluate(f'({element}).getBoundingClientRect().toJSON()')
        return box['x'] + 0.5 * box['width'], box['y'] + 0.5 * box['height']

    def hover(self, element: str) -> None:
        """Move the mouse onto an element, given as an expression."""
        x, y = self.middle_of(element)
        self.call('Input.dispatchMouseEvent', type='mouseMoved', x=x, y=y)

    def click(self, element: str) -> None:
        """Press and release the mouse's left button on an element, given as an expression."""
        x, y = self.middle_of(element)
        for kind in ('mousePressed', 'mouseReleased'):
            self.call('Input.dispatchMouseEvent', type=kind, x=x, y=y, button='left', clickCount=1)

    def tap(self, element: str) -> None:
        """Touch an element, given as an expression."""
        x, y = self.middle_of(element)
        self.call('Input.dispatchTouchEvent', type='touchStart', touchPoints=[{'x': x, 'y': y}])
        self.call('Input.dispatchTouchEvent', type='touchEnd', touchPoints=[])

    def pdf(self) -> bytes:
        """As it prints."""
        return base64.b64decode(self.call('Page.printToPDF', preferCSSPageSize=True, printBackground=True)['data'])

    def of_kind(self, method: str) -> List[Dict[str, Any]]:
        """Parameters of the events of a kind since the page was opened."""
        return [event['params'] for event in self.events if event.get('method') == method]

    def complaints(self) -> List[str]:
        """Whatever the console shows as a warning or an error."""
        logged = [
            event['entry']['text']
            for event in self.of_kind('Log.entryAdded')
            if event['entry']['level'] in ('warning', 'error')
        ]
        called = [str(event['args']) for event in self.of_kind('Runtime.consoleAPICalled')]
        thrown = [str(event['exceptionDetails']) for event in self.of_kind('Runtime.exceptionThrown')]
        return logged + called + thrown

    def _next(self) -> Dict[str, Any]:
        message = json.loads(self._loop.run_until_complete(self._receive()))
        if 'method' in message:
            self.events.append(message)
        return message

    # Coroutines: tornado's futures belong to the loop that runs when they are made.

    async def _send(self, text: str) -> None:
        await self._socket.write_message(text)

    async def _receive(self) -> str:
        return await asyncio.wait_for(self._socket.read_message(), ANSWER_TIMEOUT_S)


@contextlib.contextmanager
def opened_page(executable: str, profile: Path) -> Iterator[Page]:
    """A page of a new browser, which ends with the context.

    Args:
        profile: an empty folder for what the browser keeps.
    """
    # Containers run as root, where Chromium's own sandbox cannot start; the pages are ours.
    process = subprocess.Popen(
        [
            executable,
            '--headless',
            '--no-sandbox',
            '--disable-gpu',
            '--disable-dev-shm-usage',
            '--no-first-run',
            '--disable-background-networking',
            '--remote-debugging-port=0',
            f'--user-data-dir={profile}',
            'about:blank',
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    loop = asyncio.new_event_loop()
    try:
        socket = loop.run_until_complete(_connected(_address(profile)))
        yield Page(loop, socket)
        loop.run_until_complete(_close(socket))
    finally:
        process.terminate()
        try:
            process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
        loop.close()


async def _close(socket: WebSocketClientConnection) -> None:
    socket.close()


async def _connected(address: str) -> WebSocketClientConnection:
    return await websocket_connect(address, max_message_size=MOST_BYTES)


def _address(profile: Path) -> str:
    """Return the address of the first tab, once the browser has written its port."""
    port_file, deadline = profile / 'DevToolsActivePort', time.monotonic() + START_TIMEOUT_S
    while not (port_file.is_file() and port_file.read_text(encoding='ascii').count('\n')):
        assert time.monotonic() < deadline, 'the browser did not start'
        time.sleep(0.05)
    port = port_file.read_text(encoding='ascii').split('\n')[0]
    with urllib.request.urlopen(f'http://127.0.0.1:{port}/json/list') as answer:
        return next(tab['webSocketDebuggerUrl'] for tab in json.load(answer) if tab['type'] == 'page')
