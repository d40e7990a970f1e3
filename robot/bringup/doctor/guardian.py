"""Whether the guardian, which stands in for a watchdog that servos lack, can do its work."""

from gazerig.drivers.errors import SetupError
from gazerig.robot.bringup.doctor.findings import Finding
from gazerig.robot.guardian.guardian import Guardian
from gazerig.robot.guardian.release_plan import ReleasePlan, describe

WHERE = "guardian"


def examine_guardian(plan: ReleasePlan) -> Finding:
    """Start a guardian, let it end again, and return what it would do; nothing is sent.

    Args:
        plan: what it would let go of.
    """
    guardian = Guardian((plan,))
    try:
        guardian.join(0)
        guardian.wait_until_ready()
    except SetupError as error:
        return Finding("error", str(error), WHERE, "torque stays off until it starts")
    finally:
        guardian.leave(0)
    return Finding("ok", f"{describe(plan)} within .5 s if the program dies or hangs", WHERE)
