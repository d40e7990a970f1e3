"""The garbage collector, kept from costing slots while the head moves."""

import gc


def set_aside() -> None:
    """Have later passes of the garbage collector look only at what is made from now on.

    A full pass over all that start-up made takes 20 ms, four slots, so what is there now is set
    aside. Before torque is on, as nothing may keep the servos waiting after. What was set aside for
    a robot that ran before in this process is looked through again first, and so let go.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()
