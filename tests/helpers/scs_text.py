"""A rig of Feetech SCS servos, made of the shipped one of STS servos."""

from gazerig.config.load import shipped_path


def scs_text(neck: str = "scs15") -> str:
    """Write the rig; ``neck``: the model of the neck's servos."""
    eyes, head = shipped_path("rigs", "feetech").read_text(encoding="utf-8").split("\n  neck_yaw:")
    eyes = eyes.replace("model: sts3215", "model: scs0009")
    text = f"{eyes}\n  neck_yaw:{head.replace('model: sts3215', f'model: {neck}')}"
    text = text.replace("zero_step: 2048", "zero_step: 512").replace("name: feetech", "name: scs")
    return text.replace("  rate_hz: 200", "  rate_hz: 50")
