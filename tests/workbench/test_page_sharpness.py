"""The picture has the screen's own pixels, also when the open page is zoomed."""

from typing import Any

from .conftest import until

WITH_A_CARD = """
for (const kind of [WebGLRenderingContext, WebGL2RenderingContext]) {
  const { getExtension } = kind.prototype;
  kind.prototype.getExtension = function (name) {
    return name === "WEBGL_debug_renderer_info" ? null : getExtension.call(this, name);
  };
}
"""
"""Lets the page take the browser for one that draws with a graphics card."""


def test_the_picture_has_the_resolution_of_the_screen(viewing: str, browser: Any) -> None:
    page = browser.new_page(viewport={"width": 900, "height": 500})
    page.add_init_script(WITH_A_CARD)
    tools = page.context.new_cdp_session(page)
    page.goto(viewing)
    canvas = page.locator(".picture > canvas")
    until(lambda: page.evaluate("window.kbot !== undefined"))

    def ratio() -> float:
        return float(canvas.evaluate("c => c.width / c.clientWidth"))

    assert ratio() == 1.0
    for scale in (1.25, 2.0, 1.0):  # as the browser's zoom does: fewer, larger pixels
        size = {"width": round(900 / scale), "height": round(500 / scale)}
        metrics = {**size, "deviceScaleFactor": scale, "mobile": False}
        tools.send("Emulation.setDeviceMetricsOverride", metrics)
        until(lambda scale=scale: abs(ratio() - scale) < 0.01)
    page.close()
