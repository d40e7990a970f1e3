"""The emulated STS bus: the maker's packets."""

from servo_bench import FeetechBench

MAKERS = {
    "ping": "FF FF 01 02 01 FB",
    "read": "FF FF 01 04 02 38 02 BE",
    "write": "FF FF 01 09 03 2A 00 08 00 00 E8 03 D5",
    "sync write": "FF FF FE 20 83 2A 06 01 00 08 00 00 E8 03 02 00 08 00 00 E8 03"
    " 03 00 08 00 00 E8 03 04 00 08 00 00 E8 03 58",
}
"""Examples of Feetech's protocol manual."""


def test_the_makers_examples_are_answered_to_the_byte():
    bench = FeetechBench(*[(i, "sts3215", 1304.0) for i in (1, 2, 3, 4)])
    said = [bench.chain.receive(bytes.fromhex(MAKERS[n])) for n in ("ping", "read", "write")]
    assert said[0] == bytes.fromhex("FF FF 01 02 00 FC")
    assert said[1] == bytes.fromhex("FF FF 01 04 00 18 05 DD")
    assert said[2] == bytes.fromhex("FF FF 01 02 00 FC")
    assert bench.read(1, 46, 2) == 1000
    assert bench.chain.receive(bytes.fromhex(MAKERS["sync write"])) == b""
    assert [bench.read(i, 42, 2) for i in (1, 2, 3, 4)] == [2048] * 4
