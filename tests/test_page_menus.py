"""Choices made on the page reach the rig."""

import json
import socket
import time

import viser

from robot.page import ASK, CHOICES, MESSAGE_BYTES, Page
from robot.page_view import News, View, drain, tell


def linked() -> tuple[Page, socket.socket]:
    """Give a page's sending side and the socket its process would hold."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setblocking(False)
    page = Page("127.0.0.1", 8080)
    page._socket = ours
    return page, theirs


def test_menus_go_to_the_page_and_choices_come_back_once() -> None:
    page, theirs = linked()
    with theirs:
        page.offer({"behaviour": ("wait", "guard")})
        news = drain(theirs)
        assert news.choices == {"behaviour": ["wait", "guard"]}
        assert page.asked() is None
        tell(theirs, "behaviour", "guard")
        assert page.asked() == ("behaviour", "guard")
        assert page.asked() is None
        page.close()


def test_a_choice_for_a_rig_that_is_gone_is_no_error() -> None:
    page, theirs = linked()
    page.close()
    with theirs:
        tell(theirs, "behaviour", "guard")


def test_messages_are_what_they_say() -> None:
    page, theirs = linked()
    with theirs:
        page.offer({"behaviour": ("wait",)})
        message = theirs.recv(MESSAGE_BYTES)
        assert message[:1] == CHOICES and json.loads(message[1:]) == {"behaviour": ["wait"]}
        tell(theirs, "a", "b")
        assert page._socket is not None and page._socket.recv(100) == ASK + b'["a", "b"]'
        page.close()


def test_a_menu_on_the_page_asks_when_it_is_changed() -> None:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        asked: list[tuple[str, str]] = []
        view = View(server, lambda menu, choice: asked.append((menu, choice)))
        view.show(News((), None, False, {"behaviour": ["wait", "guard", "attack"]}))
        handles = server.gui._gui_input_handle_from_uuid.values()
        (menu,) = (h for h in handles if getattr(h, "label", "") == "behaviour")
        assert menu.value == "wait"
        menu.value = "attack"
        time.sleep(0.3)  # the handler runs in a thread of the server
        assert asked == [("behaviour", "attack")]
    finally:
        server.stop()
