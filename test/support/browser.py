"""A headless Chromium for tests, driven over its debugging protocol on loopback."""

import asyncio
import base64
import contextlib
import json
import shutil
import subprocess
import time
import urllib.request

import pytest
from tornado.websocket import websocket_connect

START_TIMEOUT_S = ANSWER_TIMEOUT_S = 60.0
CONDITION_TIMEOUT_S = END_TIMEOUT_S = 10.0
MOST_BYTES = 64 * 1024 * 1024  # of a PDF
BROWSER = next(filter(None, map(shutil.which, ('chromium', 'chromium-browser', 'google-chrome'))), None)
NEEDS_BROWSER = pytest.mark.skipif(BROWSER is None, reason='no Chromium on this machine')
# Containers run as root, where Chromium's own sandbox cannot start; the pages are ours.
SWITCHES = (
    '--headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run --disable-background-networking '
    '--remote-debugging-port=0'
)

CUT_TEXTS = """
  [...document.querySelectorAll('body *')].filter((each) => {
    const {left, right, width} = each.getBoundingClientRect();
    if (each.matches('.drawing svg text')) {
      const chart = each.closest('svg').getBoundingClientRect();
      const shows = width && each.textContent.trim() && each.getAttribute('opacity') !== '0';
      return shows && (left < chart.left - 1 || right > chart.right + 1);
    }
    const scrolls = each.closest('.wide, pre, svg, select');
    const overflows = each.scrollWidth > each.clientWidth + 1 && getComputedStyle(each).display !== 'inline';
    return width && each.innerText && !scrolls && (right > innerWidth + 1 || overflows);
  }).map((each) => each.textContent.trim().slice(0, 60))
"""


class Page:
    """One tab; elements are given as JavaScript expressions."""

    def __init__(self, loop, socket):
        self._loop, self._socket = loop, socket
        self._number, self.events = 0, []

    def call(self, method, **params):
        """Result of a command; what happens meanwhile goes to `events`."""
        self._number += 1
        self._run(self._socket.write_message, json.dumps({'id': self._number, 'method': method, 'params': params}))
        while True:
            message = self._next()
            if message.get('id') == self._number:
                assert 'error' not in message, message
                return message['result']

    def _run(self, function, *arguments):
        """Await a future of tornado, which belongs to the loop that runs when it is made."""

        async def answer():
            return await asyncio.wait_for(function(*arguments), ANSWER_TIMEOUT_S)

        return self._loop.run_until_complete(answer())

    def _next(self):
        message = json.loads(self._run(self._socket.read_message))
        if 'method' in message:
            self.events.append(message)
        return message

    def open(self, path, width_px):
        """Load a file into a window of this width, and wait until it is loaded."""
        size = {'width': width_px, 'height': 844, 'deviceScaleFactor': 1, 'mobile': width_px < 600}
        self.call('Emulation.setDeviceMetricsOverride', **size)
        for domain in ('Page', 'Runtime', 'Log', 'Network'):
            self.call(f'{domain}.enable')
        self.events.clear()
        self.call('Page.navigate', url=path.resolve().as_uri())
        while not self.of_kind('Page.loadEventFired'):
            self._next()

    def evaluate(self, expression):
        """Value of a JavaScript expression, promises awaited."""
        result = self.call('Runtime.evaluate', expression=expression, returnByValue=True, awaitPromise=True)
        assert 'exceptionDetails' not in result, result
        return result['result'].get('value')

    def wait_for(self, condition):
        """Wait until a JavaScript expression is true."""
        deadline = time.monotonic() + CONDITION_TIMEOUT_S
        while not self.evaluate(condition):
            assert time.monotonic() < deadline, condition
            time.sleep(0.02)

    def middle_of(self, element):
        """Scroll to an element; return its middle in the window."""
        self.evaluate(f'({element}).scrollIntoView({{block: "center", behavior: "instant"}})')
        box = self.evaluate(f'({element}).getBoundingClientRect().toJSON()')
        return {'x': box['x'] + 0.5 * box['width'], 'y': box['y'] + 0.5 * box['height']}

    def hover(self, element):
        self.call('Input.dispatchMouseEvent', type='mouseMoved', **self.middle_of(element))

    def click(self, element):
        for kind in ('mousePressed', 'mouseReleased'):
            self.call('Input.dispatchMouseEvent', type=kind, button='left', clickCount=1, **self.middle_of(element))

    def tap(self, element):
        self.call('Input.dispatchTouchEvent', type='touchStart', touchPoints=[self.middle_of(element)])
        self.call('Input.dispatchTouchEvent', type='touchEnd', touchPoints=[])

    def pdf(self):
        return base64.b64decode(self.call('Page.printToPDF', preferCSSPageSize=True, printBackground=True)['data'])

    def of_kind(self, method):
        """Parameters of the events of a kind since the page was opened."""
        return [event['params'] for event in self.events if event.get('method') == method]

    def cut_texts(self):
        """Texts that are cut: beyond the window or their element, unless it scrolls, or beyond their chart."""
        return self.evaluate(CUT_TEXTS)

    def complaints(self):
        """Whatever the console shows as a warning or an error."""
        entries = [event['entry'] for event in self.of_kind('Log.entryAdded')]
        logged = [entry['text'] for entry in entries if entry['level'] in ('warning', 'error')]
        called = [str(event['args']) for event in self.of_kind('Runtime.consoleAPICalled')]
        return logged + called + [str(event['exceptionDetails']) for event in self.of_kind('Runtime.exceptionThrown')]


@contextlib.contextmanager
def opened_page(profile):
    """A page of a new browser, which ends with the context; `profile` is an empty folder for what it keeps."""
    command = [BROWSER, *SWITCHES.split(), f'--user-data-dir={profile}', 'about:blank']
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    loop = asyncio.new_event_loop()

    async def connected(address):
        return await websocket_connect(address, max_message_size=MOST_BYTES)

    try:
        yield Page(loop, loop.run_until_complete(connected(_address(profile))))
    finally:
        process.terminate()
        try:
            process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
        loop.close()


def _address(profile):
    """Address of the first tab, once the browser has written its port."""
    port_file, deadline = profile / 'DevToolsActivePort', time.monotonic() + START_TIMEOUT_S
    while not (port_file.is_file() and port_file.read_text(encoding='ascii').count('\n')):
        assert time.monotonic() < deadline, 'the browser did not start'
        time.sleep(0.05)
    port = port_file.read_text(encoding='ascii').split('\n')[0]
    with urllib.request.urlopen(f'http://127.0.0.1:{port}/json/list') as answer:
        return next(tab['webSocketDebuggerUrl'] for tab in json.load(answer) if tab['type'] == 'page')
