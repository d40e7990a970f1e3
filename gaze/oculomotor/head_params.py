"""Parameters of head movements, with the sources of their values.

How far the head goes: 0.77 of what exceeds the eye-only range, 35.8 deg wide (Stahl 1999;
between people the range varies by 31.9 deg, the slope by 0.16), or eq 7 of Mitake et al.,
or a fixed share. People roll their heads by a few degrees when they turn to somebody beside
them; which ear goes down, and how much with how much interest, is a choice made here.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from gazerig.params import Bounds


@dataclass(frozen=True)
class HeadParams:
    """Start, share, duration and roll of head movements."""

    # fmt: off
    goal_model: Annotated[Literal["attention", "align", "stahl"],
        "share of the head in a gaze shift: head_slope of what exceeds the eye-only range (stahl), by salience (attention, eq 7), or "
        "fixed (align)"] = "stahl"
    eye_only_range_deg: Annotated[float, Bounds(0, 180),
        "with goal_model stahl: full width of the range of targets, as seen from where the head points, that the eyes take alone; "
        "people 4 to 68"] = 35.8
    head_slope: Annotated[float, Bounds(0, 1),
        "with goal_model stahl: degrees of head for each degree beyond that range; people .61 to .93"] = 0.77
    max_offset_deg: Annotated[float, Bounds(0, 90),
        "with the other two: how far short of the target the head stops at min_salience, and the eccentricity beyond which it starts to "
        "move; both at most the eye's limit less eye_margin_deg"] = 30.0
    eye_margin_deg: Annotated[float, Bounds(0, 30), "distance that the eyes keep from their limit"] = 2.0
    min_salience: Annotated[float, Bounds(0, 10), "salience A1 of the least interest: the head turns and rolls least"] = 0.2
    max_salience: Annotated[float, Bounds(0, 10), "salience A2 of the highest interest: the head turns and rolls most"] = 1.0
    align: Annotated[float, Bounds(0, 1),
        "with goal_model align: 0: the head stops max_offset_deg short of the target, 1: it faces the target"] = 0.5
    literal_reach: Annotated[bool, "use max_offset_deg even if it exceeds the eyes' limit, as printed in the paper"] = False
    roll_deg: Annotated[float, Bounds(0, 20),
        "roll of the head, ear to the side that it turns to, at the highest interest for a target 30 deg or more aside; 0: none"] = 4.0
    lead_ms: Annotated[float, Bounds(0, 100), "how long the head starts before the eyes, for top-down targets to which it turns"] = 0.0
    start_delay_ms: Annotated[float, Bounds(0, 1000), "how long the head starts after the eyes, for bottom-up targets"] = 20.0
    base_speed_deg_s: Annotated[float, Bounds(5, 500), "V0: the peak speed of a head movement of A degrees is (4/3 A/50 + 0.4) V0"] = 70.0
    min_move_ms: Annotated[float, Bounds(20, 5000), "shortest duration of a head movement; otherwise small ones would be twitches"] = 300.0
    replan_deg: Annotated[float, Bounds(0.05, 20), "a moving head plans its movement again when the goal changes by this much"] = 1.0
    recentre_after_ms: Annotated[float, Bounds(0, 60000),
        "after an eye has been eccentric for this long, the head turns slowly to bring it back"] = 800.0
    comfort_deg: Annotated[float, Bounds(0, 90), "eccentricity up to which an eye is not brought back"] = 8.0
    recentre_speed_deg_s: Annotated[float, Bounds(1, 200), "peak speed of the head while it brings the eyes back"] = 30.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check the order of the two amounts of attention.

        Raises:
            ValueError: max_salience is not above min_salience.
        """
        if self.max_salience <= self.min_salience:
            raise ValueError("max_salience must be above min_salience")
