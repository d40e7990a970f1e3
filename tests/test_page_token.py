"""The token of the page: without it nothing is seen and nothing moves."""

import socket
from collections.abc import Iterator

import pytest
from page_at_the_door import ELSEWHERE, PATIENCE_S, TOKEN, Rig, fetch, opened
from websockets.exceptions import InvalidStatus


@pytest.fixture(scope="module")
def near() -> Iterator[Rig]:
    """A page for this machine alone."""
    with opened("127.0.0.1") as rig:
        yield rig


@pytest.fixture(scope="module")
def far() -> Iterator[Rig]:
    """A page as other machines see it: at an address that has no name of the loopback."""
    with opened("127.0.0.2") as rig:
        yield rig


# --- the token ------------------------------------------------------------------------------


@pytest.fixture(params=["127.0.0.1", "127.0.0.2"])
def either(request: pytest.FixtureRequest, near: Rig, far: Rig) -> Rig:
    """The page for this machine, which has other users, and the one for others."""
    return near if request.param == "127.0.0.1" else far


@pytest.mark.parametrize(
    "path", ["/", "/view/", "/rig/line", "/rig/stop.js", "/?token=wrong", "/?token=", "/?token=%ff"]
)
def test_without_the_token_nothing_is_seen(either: Rig, path: str) -> None:
    status, headers, text = fetch(either.url + path)
    assert status == 403 and text.startswith("refused") and len(text.splitlines()) == 1
    assert "Set-Cookie" not in headers


@pytest.mark.parametrize("cookie", [None, "wrong", "", "\xff"])
def test_without_the_token_nothing_moves(either: Rig, cookie: str | None) -> None:
    either.asked.clear()
    either.stops.clear()
    given = None if cookie is None else f"{either.door._cookie}={cookie}"
    for body in (b'{"do":"resume"}', b'{"do":"stop","why":"x"}'):
        assert either.post(body, Cookie=given)[0] == 403
    for path in ("/view", "/rig/line"):
        with pytest.raises(InvalidStatus) as refused:
            either.knock(path, Cookie=given)
        assert refused.value.response.status_code == 403
    assert either.asked == either.stops == []


def test_the_token_becomes_a_cookie_and_leaves_the_address(either: Rig) -> None:
    status, headers, text = fetch(f"{either.url}/?look=here&token={TOKEN}")
    assert (status, headers["Location"], text) == (302, "/?look=here", "")
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    assert either.get()[0] == 200
    with either.knock() as socket_:
        assert socket_.recv(timeout=PATIENCE_S)


@pytest.mark.parametrize(
    "path", ["//evil/", "/%5Cevil/", "/\\evil/", "///evil", "//evil/%2e%2e//x"]
)
def test_the_token_leads_to_this_page_and_nowhere_else(near: Rig, path: str) -> None:
    with socket.create_connection(tuple(near.address.split(":"))) as there:  # type: ignore[arg-type]
        there.sendall(
            f"GET {path}?token={TOKEN} HTTP/1.1\r\nHost: {near.address}\r\n"
            "Connection: close\r\n\r\n".encode()
        )
        answer = there.recv(4096).decode()
    place = next(line for line in answer.splitlines() if line.startswith("Location: "))
    assert place.startswith("Location: /") and place[11:12] not in ("/", "\\")


def test_the_token_does_not_help_another_origin(either: Rig) -> None:
    either.asked.clear()
    with pytest.raises(InvalidStatus):
        either.knock(origin=ELSEWHERE)
    assert either.post(b'{"do":"resume"}', Origin=ELSEWHERE)[0] == 403
    assert either.asked == []


@pytest.mark.parametrize(
    "path",
    ["/../../../../etc/passwd", "/%2e%2e/%2e%2e/%2e%2e/etc/passwd", "/..%2f..%2f..%2fetc%2fpasswd",
     "//etc/passwd", "/assets/../../../../../../etc/passwd", "/\\..\\etc\\passwd"],
)  # fmt: skip
def test_no_path_leads_out_of_the_pages_own_files(near: Rig, path: str) -> None:
    with socket.create_connection(tuple(near.address.split(":"))) as there:  # type: ignore[arg-type]
        there.settimeout(PATIENCE_S)
        there.sendall(
            f"GET {path} HTTP/1.1\r\nHost: {near.address}\r\nCookie: {near.cookie}\r\n"
            "Connection: close\r\n\r\n".encode()
        )
        answer = b"".join(iter(lambda: there.recv(1 << 16), b""))
    assert b"root:" not in answer and b" 500 " not in answer.splitlines()[0]
