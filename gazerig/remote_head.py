"""A head that runs in another program of the same user."""

from typing import Any, Self

from gazerig.errors import HeadEnded
from gazerig.head import Head, Order
from gazerig.robot.loop.head_state import HeadEvent, HeadState
from gazerig.robot.model.commands import Command, Request, Revert, Set
from gazerig.robot.model.reply import Progress
from gazerig.robot.net.client import RequestRejected, RobotClient


class RemoteHead(Head):
    """A connection to a running head; ``gazerig.connect`` creates it.

    At the end of the block it gives up control and disconnects; the head continues to run.

    Args:
        client: the connection.
    """

    _stay = False
    _poll_s = 0.02

    def __init__(self, client: RobotClient) -> None:
        self._client = client
        self._who = client.who
        self.rig = str(client.status()["rig"])
        self.pid = client.pid

    def __enter__(self) -> Self:
        """Return the head itself."""
        return self

    def __exit__(self, *raised: Any) -> None:
        """Give up control and disconnect."""
        self._client.close()

    @property
    def state(self) -> HeadState:
        """Return the newest tick of the control loop."""
        state = self._client.state()[0]
        if state is None:
            raise HeadEnded("the head has just started: its loop is not running yet")
        return state

    def _ask(self, request: Request, kind: Any) -> Any:
        if isinstance(request, Set):
            return self._client.set_many(request.changes)
        if isinstance(request, Revert):
            return self._client.change(request)
        return self._client.ask(request, kind)

    def _progress(self) -> Progress:
        state = self.state
        return Progress(state.client_control, state.tracks)

    def _events(self, after: int) -> tuple[HeadEvent, ...]:
        return self._client.state(after)[1]

    def _send(self, command: Command) -> Order:
        try:
            reply = self._client.send(command)
        except RequestRejected as rejected:
            if rejected.reply is None:
                raise
            reply = rejected.reply
        return Order(self, lambda: reply)


def connect(
    pid: int | None = None, *, name: str | None = None, who: str = "a program"
) -> RemoteHead:
    """Connect to a head that runs in another program of the same user.

    Args:
        pid: process id of the head, if several heads run.
        name: its name (``gazerig run --name``), if several heads run.
        who: name of this program in messages and on the page.

    Raises:
        NotFound: no head runs, or several run and the arguments do not select one; the message
            lists them.
    """
    return RemoteHead(RobotClient.connect(pid if name is None else name, who))
