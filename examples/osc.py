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

        def play(_: str, track: str) -> None:
            try:
                print(head.play(track).reply.text())
            except gazerig.Refused as error:  # an unknown track, or a stop
                print(error)

        desk = Dispatcher()
        desk.map("/play", play)
        desk.map("/stop", lambda _: print(head.stop("OSC").reply.refused or "stopped"))
        BlockingOSCUDPServer(("127.0.0.1", 9000), desk).serve_forever()
