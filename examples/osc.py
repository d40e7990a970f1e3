"""OSC: a lighting or sound desk starts tracks, /play nod; needs pip install python-osc.

Shows: orders to a running head from another protocol.
Run:   gazerig run --mock, then python examples/osc.py
"""

import gazerig

if __name__ == "__main__":
    try:
        from pythonosc.dispatcher import Dispatcher
        from pythonosc.osc_server import BlockingOSCUDPServer
    except ImportError:
        raise SystemExit("pip install python-osc") from None
    with gazerig.connect(who="osc") as head:
        desk = Dispatcher()
        desk.map("/play", lambda _, track: print(head.play(track).reply.text()))
        desk.map("/stop", lambda _: head.stop("OSC"))
        BlockingOSCUDPServer(("127.0.0.1", 9000), desk).serve_forever()
