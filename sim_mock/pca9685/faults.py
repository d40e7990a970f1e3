"""Faults of emulated PCA9685 boards and their servos, in addition to those of the line."""

from gazerig.sim_mock.faults.grammar import SWITCH, TIME, Argument, CommandTable, Verb, count
from gazerig.sim_mock.faults.hobby import channel_word, hobby_verbs
from gazerig.sim_mock.faults.verbs import counted_command, switch_command

CASES = {"oscillator-mhz": "MHZ"}

# fmt: off
OWN: dict[str, Verb] = {
    "nack": Verb(counted_command("nack", "transfers are not acknowledged"), (Argument("N", count, True),),
                 "the next N transfers are not acknowledged", TIME),
    "stuck": Verb(switch_command("stuck", "the bus is stuck"), (SWITCH,),
                  "the data line is held low: no transfer is possible", TIME),
    "absent": Verb(switch_command("absent", "the boards are off the bus"), (SWITCH,),
                   "the boards are off the bus, pulses continue", TIME),
    "foreign": Verb(switch_command("foreign", "another chip answers"), (SWITCH,),
                    "chips of another kind answer", TIME),
}
# fmt: on

COMMANDS = CommandTable(
    hobby_verbs(channel_word(255), "transfers that only write", OWN), CASES, "a channel"
)
