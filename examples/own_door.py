"""A door of your own: any program that sends one word per UDP datagram steers the conversation.

Shows: orders to a running head from messages of a neighbour.
Run:   python examples/own_door.py         next to gazerig run --mock
       echo -n listening > /dev/udp/127.0.0.1/9000      from bash; or thinking, speaking, idle
"""

import socket

import gazerig


def pass_on(head: gazerig.Head, word: str) -> None:
    """Send one word to the head as an order; other words have no effect."""
    orders = {
        "listening": head.listening,  # a person speaks
        "thinking": head.thinking,  # an answer is being prepared
        "speaking": head.speaking,  # the head's own voice begins
        "idle": head.idle,
    }
    if word in orders:
        print(word, orders[word]().reply.refused or "done")


if __name__ == "__main__":
    with gazerig.connect(who="my door") as head, socket.socket(type=socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", 9000))  # this computer only
        while True:
            pass_on(head, port.recv(64).decode("ascii", "replace").strip())
