"""Pages of one browser that tests use one after the other. A reused page loads in half the time."""

from typing import Any
from urllib.parse import urlsplit

HELD = ("w", "a", "s", "d", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "Shift", "Control", "Alt")
"""Keys that a test may have left down."""

SLOW_SCREEN = """(() => {
  const period = 50
  const request = window.requestAnimationFrame.bind(window)
  const cancel = window.cancelAnimationFrame.bind(window)
  const cancels = new Map()
  let due = 0
  let count = 0
  window.requestAnimationFrame = (draw) => {
    const id = ++count
    const timer = setTimeout(() => {
      const frame = request((time) => {
        cancels.delete(id)
        due = performance.now() + period
        draw(time)
      })
      cancels.set(id, () => cancel(frame))
    }, Math.max(due - performance.now(), 0))
    cancels.set(id, () => clearTimeout(timer))
    return id
  }
  window.cancelAnimationFrame = (id) => {
    cancels.get(id)?.()
    cancels.delete(id)
  }
})()"""
"""Gives the page a screen of 20 Hz. Chromium draws in software here: at 60 Hz, drawing a robot that drives
keeps a whole core busy."""


class Pages:
    """Hands out pages. What a page displayed, stored and held down is reset when it is given back."""

    def __init__(self, browser: Any) -> None:
        self._browser = browser
        self._idle: dict[str, list[Any]] = {}

    def open(self, address: str, **options: Any) -> Any:
        """Open a page of a browser with these options. `complaints` are its script errors and blocked
        loads."""
        kind = repr(sorted(options.items()))
        idle = self._idle.setdefault(kind, [])
        page = idle.pop() if idle else self._made(options)
        page.kind, page.origin, page.complaints[:] = kind, address_origin(address), []
        page.goto(address)
        return page

    def give_back(self, page: Any) -> None:
        if page.is_closed():
            return
        if page.origin == "":  # all files share one storage
            page.close()
            return
        for key in HELD:
            page.keyboard.up(key)
        page.mouse.up()
        page.mouse.move(0, 0)
        page.goto("about:blank")
        page.tools.send("Storage.clearDataForOrigin", {"origin": page.origin, "storageTypes": "all"})
        self._idle[page.kind].append(page)

    def _made(self, options: dict[str, Any]) -> Any:
        page = self._browser.new_page(**options)
        page.set_default_timeout(60_000)
        page.add_init_script(SLOW_SCREEN)
        page.tools = page.context.new_cdp_session(page)
        complaints = page.complaints = []
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda m: complaints.append(m.text) if is_complaint(m) else None)
        return page


def is_complaint(message: Any) -> bool:
    """Whether a message of the console is an error of the page. A page that tries to reconnect to a stopped
    server also reports one for each attempt. A server that answers but refuses the page does not count as
    stopped."""
    is_stopped = (
        message.text.startswith("WebSocket connection to ") and "net::ERR_CONNECTION_" in message.text
    )
    return message.type == "error" and not is_stopped


def address_origin(address: str) -> str:
    """Return `http://host:port` of an address, or an empty string for a file."""
    parts = urlsplit(address)
    return f"{parts.scheme}://{parts.netloc}" if parts.netloc else ""
