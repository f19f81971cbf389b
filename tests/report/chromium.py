"""Drives a headless Chromium over its debugging pipe: no packages beyond the standard library.

Messages are JSON with a zero byte behind each (Chrome DevTools Protocol, --remote-debugging-pipe):
the browser reads its file descriptor 3 and writes to 4.
"""

from __future__ import annotations

import base64
import itertools
import json
import os
import select
import shutil
import subprocess
import time
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


def find_chromium() -> str | None:
    """Path of a Chromium, from $MARTHS_CHROMIUM or the usual names."""
    asked = os.environ.get("MARTHS_CHROMIUM")
    return asked or next((path for name in NAMES if (path := shutil.which(name))), None)


class Page:
    """A page in a browser of its own.

    Attributes:
        complaints: console errors and uncaught exceptions so far.
        requests: addresses asked for so far.
    """

    def __init__(self, executable: str, profile: Path):
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()
        # The shell puts the pipes where the browser looks for them, whatever numbers they have.
        script = f'exec "$0" "$@" 3<&{theirs_in} 4>&{theirs_out}'
        flags = ["--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe",
                 "--no-first-run", "--disable-dev-shm-usage", f"--user-data-dir={profile}",
                 "--disable-background-networking", "about:blank"]  # fmt: skip
        self.process = subprocess.Popen(
            ["/bin/bash", "-c", script, executable, *flags],
            pass_fds=(theirs_in, theirs_out),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        self._in, self._out, self._buffer = ours_in, ours_out, b""
        self._numbers = itertools.count(1)
        self.complaints: list[str] = []
        self.requests: list[str] = []
        target = self._send("Target.createTarget", {"url": "about:blank"}, None)["targetId"]
        attached = self._send("Target.attachToTarget", {"targetId": target, "flatten": True}, None)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._send(f"{domain}.enable")

    def _send(self, method: str, parameters: dict | None = None, session: str | None = "page"):
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters or {}}
        if session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._receive(60.0)
            if answer.get("id") == number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self._note(answer)

    def _receive(self, seconds: float) -> dict:
        end = time.monotonic() + seconds
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._in], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                raise TimeoutError("Chromium did not answer")
            piece = os.read(self._in, 1 << 20)
            if not piece:
                raise RuntimeError("Chromium ended")
            self._buffer += piece
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def _note(self, event: dict) -> None:
        method, about = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            details = about["exceptionDetails"]
            self.complaints.append(details.get("exception", details).get("description", "?"))
        elif method == "Runtime.consoleAPICalled" and about["type"] in ("error", "assert"):
            self.complaints.append(str([a.get("value") for a in about["args"]]))
        elif method == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.complaints.append(about["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(about["request"]["url"])

    def resize(self, width: int, height: int, mobile: bool = False) -> None:
        """Set the window's size [CSS pixels]."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile}
        self._send("Emulation.setDeviceMetricsOverride", size)

    def open(self, path: Path, ready: str) -> None:
        """Load a file and wait until the expression `ready` is true."""
        self._send("Page.navigate", {"url": path.resolve().as_uri()})
        self.wait(ready)

    def evaluate(self, expression: str):
        """Value of a JavaScript expression, promises awaited."""
        asked = {"expression": expression, "returnByValue": True, "awaitPromise": True}
        answer = self._send("Runtime.evaluate", asked)
        if "exceptionDetails" in answer:
            raise RuntimeError(str(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def wait(self, expression: str, seconds: float = 60.0) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + seconds
        while not self.evaluate(expression):
            if time.monotonic() > end:
                raise TimeoutError(f"{expression} did not become true; {self.complaints}")
            time.sleep(0.1)

    def click(self, selector: str) -> None:
        """Click the middle of an element with the mouse, scrolled into view."""
        x, y = self.evaluate(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            "e.scrollIntoView({block: 'center', inline: 'center'});"
            "const r = e.getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )
        self._mouse("mousePressed", x, y)
        self._mouse("mouseReleased", x, y)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press at a point, move in steps to another and let go [CSS pixels]."""
        self._mouse("mouseMoved", *start, button="none")
        self._mouse("mousePressed", *start)
        for i in range(1, 6):
            at = [a + (b - a) * i / 5 for a, b in zip(start, end, strict=True)]
            self._mouse("mouseMoved", *at)
        self._mouse("mouseReleased", *end)

    def _mouse(self, kind: str, x: float, y: float, button: str = "left") -> None:
        event = {"type": kind, "x": x, "y": y, "button": button, "clickCount": 1}
        event["buttons"] = 1 if button == "left" and kind != "mouseReleased" else 0
        self._send("Input.dispatchMouseEvent", event)

    def screenshot(self) -> bytes:
        """PNG of what the window shows."""
        return base64.b64decode(self._send("Page.captureScreenshot", {"format": "png"})["data"])

    def close(self) -> None:
        """End the browser."""
        try:
            self._send("Browser.close", session=None)
        except (OSError, RuntimeError, TimeoutError):
            self.process.kill()
        self.process.wait(20)
        os.close(self._in)
        os.close(self._out)
