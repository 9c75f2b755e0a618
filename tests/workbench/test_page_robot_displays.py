"""The robot, its frames and contacts by their pixels, and the grid."""

from collections.abc import Callable
from typing import Any

import numpy as np

from kbot.messages import Header, Quaternion, TFMessage, TransformStamped, Vector3
from kbot.messages import Transform as TransformMessage

from .conftest import until
from .displayed import FROM_ABOVE, Show, is_red, showing
from .pictures import screenshot

OpenPage = Callable[..., Any]

RED = (255, 0, 0)


def test_axes_are_drawn_in_their_frame(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Axes")
        show.set("Axes", "length", "0.5")
        until(lambda: (show.colours((0.4, 0.0, 0.0)) @ (1.0, -1.5, 0.0) > 0).all())  # red along x
        until(lambda: (show.colours((0.0, 0.4, 0.0)) @ (-1.5, 1.0, 0.0) > 0).all())  # green along y
        show.set("Axes", "frame", "left_wheel")
        # the wheel is at (0, 0.087), and its x axis also points ahead
        until(lambda: show.colours((0.4, 0.087, 0.035))[0, 0] > 120)
        assert show.colours((0.4, 0.0, 0.0))[0, 0] < 90


def test_a_grid_has_the_configured_number_of_cells(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.add("Grid")
        for name, value in (("cell", "0.25"), ("count", "4"), ("colour", "#ff0000")):
            show.set("Grid", name, value)
        until(lambda: show.mask(RED, 90).any())
        found = show.extent(show.mask(RED, 90))
        (top, left), (bottom, right) = show.pixels([(-0.5, 0.5, 0.0), (0.5, -0.5, 0.0)])
        assert np.abs(found - [[top, left], [bottom, right]]).max() <= 2
        row = is_red(screenshot(show.page)[show.pixels([(0.0, 0.12, 0.0)])[0, 0]].astype(int))
        assert np.count_nonzero(np.diff(np.flatnonzero(row)) > 2) == 4  # five lines


def test_another_grid_draws_the_floor_after_the_first_is_removed(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.page.get_by_label("Show Grid", exact=True).check()
        show.add("Grid")
        for name, value in (("count", "0"), ("colour", "#ff0000")):  # endless lines
            show.set("Grid", name, value)
        until(lambda: "another grid draws the floor lines" in show.status("Grid"))
        assert not show.mask(RED, 90).any()
        show.page.locator(".display[data-display=Grid]").first.locator(".head").focus()
        show.page.keyboard.press("Delete")
        until(lambda: show.mask(RED, 90).sum() > 1000)
        until(lambda: show.status("Grid") == "fine")


def test_contact_forces_carry_the_weight_of_the_robot(open_page: OpenPage) -> None:
    from kbot.sim import Simulation
    from kbot.workbench.driving.contact_forces import ContactForces

    simulation = Simulation("kbot")
    contacts = ContactForces(simulation)
    simulation.run(1.0)
    mass = sum(link.inertial.mass for link in simulation.robot.links.values() if link.inertial)
    total = sum(force for _, force in contacts.forces())
    assert np.allclose(total, (0.0, 0.0, mass * 9.81), atol=1e-3)
    with showing(open_page, {}) as show:
        show.look((0.0, -0.8, 0.1), (0.0, 0.0, 0.05))
        show.add("Contacts")
        show.set("Contacts", "scale", "0.5")
        show.set("Contacts", "colour", "#ff0000")
        show.page.get_by_role("button", name="Continue").click()
        until(lambda: reds(show).sum() > 100)
        # the right wheel, nearest to the eye, carries 4.258 N of 11.28 N: 0.189 m of 0.5 m with a thin tip
        (tip,) = show.pixels([(0.0, -0.087, 0.189)])
        until(lambda: abs(show.extent(reds(show))[0, 0] - tip[0]) <= 10)


def reds(show: Show) -> np.ndarray:
    """Return where the picture has any shade of red, (height, width)."""
    image = screenshot(show.page).astype(int)
    return is_red(image.reshape(-1, 3)).reshape(image.shape[:2])


def test_inertia_is_a_box_or_an_ellipsoid_and_parts_can_be_faded(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        page = show.page
        show.look((0.0, -0.001, 0.8), (0.0, 0.0, 0.0))
        page.get_by_label("Show RobotModel", exact=True).check()
        show.row("RobotModel").locator(".head").click()
        blue = (show.mask((20, 20, 190), 60)).sum()
        assert blue > 1000
        show.set("RobotModel", "alpha", "0.3")
        until(lambda: show.mask((20, 20, 190), 60).sum() < 0.1 * blue)
        show.set("RobotModel", "alpha", "1")
        until(lambda: show.mask((20, 20, 190), 60).sum() == blue)
        show.row("RobotModel").get_by_text("Links", exact=True).click()
        page.get_by_label("Show of base_link").uncheck()
        until(lambda: show.mask((20, 20, 190), 60).sum() == 0)
        show.field("RobotModel", "visual").uncheck()
        page.get_by_label("Show of base_link").check()
        show.field("RobotModel", "inertia").check()
        show.look((0.0, -0.001, 1.6), (0.0, 0.0, 0.0))  # from nearer by, the top of the box looks larger
        until(lambda: violet(show).sum() > 500)
        box = violet(show).sum()
        show.set("RobotModel", "inertia_shape", "ellipsoid")
        # from above: a rectangle a b, or an ellipse whose half axes are sqrt(5/12) of the sides
        until(lambda: abs(violet(show).sum() / box - np.pi * 5 / 12) < 0.12)


def violet(show: Show) -> np.ndarray:
    """Return where an inertia is drawn."""
    r, g, b = np.moveaxis(screenshot(show.page).astype(int), 2, 0)
    result: np.ndarray = (b > 70) & (b > 1.35 * g) & (r > 1.1 * g)
    return result


def test_the_fixed_frame_does_not_move(open_page: OpenPage) -> None:
    with showing(open_page, {}) as show:
        page = show.page
        page.get_by_role("button", name="Global options").click()
        chooser = page.get_by_label("Fixed frame of the view")
        assert set(chooser.locator("option").all_inner_texts()) >= {"world", "map", "odom", "left_wheel"}
        page.get_by_label("Show RobotModel", exact=True).check()
        chooser.select_option("left_wheel")
        page.evaluate("kbot.look([0, -1, 0.5], [0, 0, 0])")
        page.evaluate("kbot.drawn()")
        wheel = page.evaluate("kbot.where('left_wheel')")
        box = page.locator(".picture canvas").first.bounding_box()
        # in its own frame the wheel is at the origin, the centre of the view
        assert abs(wheel["x"] - box["x"] - box["width"] / 2) < 1.5
        assert abs(wheel["y"] - box["y"] - box["height"] / 2) < 1.5
        page.get_by_label("Background of the view", exact=True).fill("#ff0000")
        page.get_by_label("Floor of the view").uncheck()
        until(lambda: show.mask(RED, 6).mean() > 0.5)


def test_frames_on_tf_are_drawn(open_page: OpenPage) -> None:
    marker_frame = TransformStamped(
        Header(frame_id="map"), "beacon", TransformMessage(Vector3(0.6, 0.4), Quaternion())
    )
    with showing(open_page, {}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.row("TF").locator(".head").click()
        show.field("TF", "axes").check()
        show.set("TF", "length", "0.5")
        show.set("TF", "filter", "beacon")
        show.bus.publish("/tf", TFMessage((marker_frame,)))
        show.page.get_by_role("button", name="Step").click()
        until(lambda: show.colours((0.7, 0.4, 0.0))[0, 0] > 150)
        assert show.colours((0.6, 0.5, 0.0))[0, 1] > 120
        assert show.colours((0.1, 0.0, 0.0))[0, 0] < 90  # the filter hides others
        show.row("TF").get_by_text("Tree").click()
        until(lambda: show.row("TF").locator(".frames li li", has_text="beacon").count())
        arrows = (232, 111, 197)
        assert not show.mask(arrows, 30).any()
        show.field("TF", "arrows").check()
        until(lambda: show.mask(arrows, 30).any())


def test_frames_are_filtered_like_in_rviz_and_names_do_not_overlap(
    open_page: OpenPage,
) -> None:
    axis = [(0.25, 0.0, 0.0), (0.85, 0.4, 0.0)]  # on the x axes of a and b
    frames = tuple(
        TransformStamped(Header(frame_id="world"), name, TransformMessage(Vector3(x, y), Quaternion()))
        for name, x, y in (("tool_a", 0.0, 0.0), ("tool_b", 0.6, 0.4), ("tool_a_too", 0.0, 0.0))
    )
    with showing(open_page, {}) as show:
        show.page.evaluate(FROM_ABOVE)
        show.row("TF").locator(".head").click()
        show.field("TF", "axes").check()
        show.set("TF", "length", "0.5")
        show.set("TF", "filter", "a$|tool_b")
        show.bus.publish("/tf", TFMessage(frames))
        show.page.get_by_role("button", name="Step").click()
        until(lambda: (show.colours(*axis)[:, 0] > 150).all())
        show.set("TF", "without", "_b")
        until(lambda: (show.colours(*axis)[:, 0] > 150).tolist() == [True, False])
        show.field("TF", "axes").uncheck()
        show.set("TF", "without", "")
        show.set("TF", "filter", "tool_a")
        show.field("TF", "names").check()

        def letters() -> np.ndarray:
            return show.mask((230, 236, 243), 60)[:300]  # without the bar at the bottom

        until(lambda: letters().sum() > 100)
        # each 22 px high, one above the other
        assert 26 < np.ptp(show.extent(letters())[:, 0]) < 44
