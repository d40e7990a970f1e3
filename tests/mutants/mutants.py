"""Mutants of gaze, perception, scanpath and drivers: one wrong line each, and who has to notice."""

from typing import NamedTuple


class Mutant(NamedTuple):
    """One piece of text replaced by another.

    file: from the root of the repository; old: stands there exactly once
    effect: what is wrong then; tests: files test_NAME.py of which one has to fail
    """

    file: str
    old: str
    new: str
    effect: str
    tests: tuple[str, ...]


MUTANTS = (
    # ---- gaze: attention
    Mutant("gaze/bottom_up.py", "        total += self.rotation\n", "",
           "eq 1 without its third term, spin", ("attention", "attention_choice")),
    Mutant("gaze/bottom_up.py", "            spin / par.rotation_reference_rad_s,\n", "            0.0,\n",
           "eq 1 of few bodies without its third term", ("group_scenes", "attention")),
    Mutant("robot/perception/perception.py", "spin) if spin else (0.0, 0.0, 0.0)", "0.0)",
           "what spins is not perceived to", ("group_scenes",)),
    Mutant("sim_mock/cameras/detections.py", "thing.radius_m, thing.spin_rad_s),)", "thing.radius_m),)",
           "the camera of a scene does not see a spin", ("group_scenes",)),
    Mutant("gaze/bottom_up.py", "raw.looming / (distance * par", "raw.looming / (par",
           "far things that come nearer draw as much as near ones", ("attention", "attention_choice")),
    Mutant("gaze/bottom_up.py", "np.exp((entered_s - t_s) / self._params.onset_s)",
           "np.exp((entered_s - t_s) / 10.0)", "what appeared draws the gaze for ever",
           ("attention", "attention_choice", "habituation")),
    Mutant("gaze/habituation.py", "habituation *= factor", "habituation *= 1.0",
           "no inhibition of return", ("habituation",)),
    Mutant("gaze/habituation.py", "id: left + risen for id", "id: left for id",
           "interest that was lost never recovers", ("habituation",)),
    Mutant("gaze/top_down.py", "/= self._params.stay_with_person", "/= 1.0",
           "the gaze does not stay with a person", ("attention", "attention_choice", "habituation")),
    Mutant("gaze/field_of_view.py", "before = (along > 0.0) & ", "before = ",
           "what is behind the eye hides things", ("attention", "attention_choice")),
    # ---- gaze: eyes, head, lids
    Mutant("gaze/saccade_trigger.py", "closing > 0.0 and least < error_rad / closing < most",
           "least < error_rad / max(closing, 1e-9) < most * 10",
           "no catch-up saccade for a target that comes across", ("shift", "oculomotor", "oculomotor_limits")),
    Mutant("gaze/saccade_trigger.py", "or rested_s < self._refractory_s", "",
           "saccades without a pause between them", ("shift", "oculomotor", "oculomotor_limits")),
    Mutant("gaze/pursuit.py", "share = 1.0 - exp(-par.gain_1_s * dt_s)",
           "share = par.gain_1_s * dt_s * dt_s", "an error of pursuit is hardly made good",
           ("pursuit", "oculomotor", "oculomotor_limits")),
    Mutant("gaze/target_prediction.py",
           "if norm(sub(p, add(sine.middle, sine.offset(at_s)))) > 0.5 * sine.size_m:", "if False:",
           "a swing that has stopped is still expected to go on", ("target_prediction",)),
    Mutant("gaze/target_prediction.py", "self._bend = self._slope()", "self._bend = _STILL",
           "motion is extrapolated along its tangent", ("target_prediction", "human_pursuit")),
    Mutant("gaze/binocular.py", "or not self._known or norm(sub(seen, before)) > most:", "or not self._known:",
           "a jump of the target is taken for its velocity", ("binocular",)),
    Mutant("gaze/binocular.py", "held = rotate_back(turned[1], rotate(turned[0], ahead))", "held = ahead",
           "the eyes go with the head", ("binocular",)),
    Mutant("gaze/head.py", "delay_ms = -par.lead_ms if target.top_down", "delay_ms = 0.0 if target.top_down",
           "the head does not lead for a top-down target", ("head", "oculomotor", "oculomotor_limits")),
    Mutant("gaze/head.py", "peak = min(peak, par.recentre_speed_deg_s)", "pass",
           "an eye that was left aside is relieved with a jerk", ("head", "oculomotor", "oculomotor_limits")),
    Mutant("gaze/saccade.py", "return 0.38 - 0.24 * min(1.0, max(0.0, over))", "return 0.38",
           "large saccades are not skewed", ("saccade",)),
    Mutant("gaze/blink_statistics.py", "between = 60.0 / per_min - length_s",
           "between = 60.0 / per_min", "the blink itself is not part of its interval", ("lids",)),
    Mutant("gaze/blink_statistics.py", "return float(rng.random()) < chance",
           "return shift_deg > 60.0", "no chance in blinks with gaze shifts", ("lids",)),
    Mutant("gaze/lids.py", 'return par.blinks_per_min if self._mode == "rest" else par.conversation_per_min',
           "return par.blinks_per_min", "a conversation does not change the rate of blinks", ("lids",)),
    Mutant("robot/control/command_choices.py",
           'self._lids.mode("rest" if mode == "none" else "conversation")', "pass",
           "asking for a conversation does not reach the lids", ("commands", "stop_and_lead")),
    Mutant("gaze/aversion.py", "looking = add(scale(ahead, cos(angle)), scale(aside, sin(angle)))",
           "looking = add(scale(ahead, cos(angle)), scale(aside, -sin(angle)))",
           "looks away to the opposite side", ("aversion",)),
    # ---- scanpath
    Mutant("gaze/scanpath.py", "mean_s = np.array(walk.dwell_mean_s) / params.rate_scale",
           "mean_s = np.array(walk.dwell_mean_s)", "rate_scale does nothing", ("scanpath_dwell", "scanpath")),
    Mutant("gaze/scanpath_dwell.py", "log(mean_s) - 0.5 * sigma2", "log(mean_s)",
           "log-normal dwells have their median at the mean", ("scanpath_dwell", "scanpath")),
    Mutant("gaze/scanpath.py", "face for face in seen if face.id == face_id", "face for face in seen if True",
           "the walk goes over the face of somebody else", ("scanpath", "scanpath_models", "attention")),
    Mutant("gaze/scanpath_models.py", "self._at = (self._at + 1) % len(self._parts)",
           "self._at = min(self._at + 1, len(self._parts) - 1)",
           "the simple model stops at its last part", ("scanpath_models",)),
    Mutant("gaze/scanpath_models.py", "return self._longest_s * (1.0 - self._rng.random())",
           "return self._longest_s", "random looks have one length", ("scanpath_models",)),
    # ---- perception
    Mutant("robot/perception/perception.py", "self._p_head = poses.head_pose(t_s)",
           "self._p_head = poses.head_pose(1e9)", "frames are placed by the newest pose of the head",
           ("perception", "camera_poses")),
    Mutant("robot/perception/tracker.py", "if track.detection.kind != detection.kind:", "if False:",
           "a hand becomes a face", ("tracks", "perception")),
    Mutant("robot/perception/tracker.py", "t_s - t.seen_s <= par.coast_ms / 1e3", "True",
           "who has left stays in sight", ("tracks", "perception")),
    Mutant("robot/perception/frame_locator.py", "    if not spread <= _MOST_SPREAD_M:", "    if False:",
           "a depth that is two things at once is believed", ("camera_depth", "perception")),
    Mutant("robot/perception/kalman.py", "kept = 1.0 if seen else exp(-dt_s / _STOPS_WITHIN_S)",
           "kept = 1.0", "somebody out of sight walks on for ever", ("track_filter", "tracks")),
    Mutant("robot/perception/hand_ownership.py", "return hypot(x, y), z", "return hypot(x, y), -z",
           "the body that belongs to a face is above it", ("true_motion", "perception", "tracks",
           "motion_room", "still_room")),
    # ---- drivers
    Mutant("drivers/servo_bus/poll_list.py", "min(2.0 * wait_s, AGAIN_LAST_S)", "AGAIN_FIRST_S",
           "a dead servo is asked ten times a second for ever",
           ("dynamixel_faults", "feetech_faults", "dynamixel_bus")),
    Mutant("drivers/servo_bus/torque.py", "if abs(now - was) > JUMP_TURN * family.steps_per_turn:",
           "if False:", "a jump at torque-on is not noticed",
           ("dynamixel_faults", "dynamixel_bus", "dynamixel_listed_faults", "feetech_bus",
            "feetech_faults", "bus_kinds_faults", "servo_bus_turn")),
    Mutant("drivers/servo_bus/sync_packets.py",
           'int.from_bytes(raw, "little") & self._mask != self._known', "False",
           "a fault or lost torque in an answer is not seen",
           ("servo_sync_read", "dynamixel_faults", "feetech_faults")),
    Mutant("drivers/servo_bus/sync_packets.py",
           "return values if self._intact(self._parts(raw), values[self._checks]) else None",
           "return values", "damaged bytes are taken for values", ("servo_sync_read",)),
    Mutant("drivers/servo_bus/feedback.py", "self._expect()\n        self.now", "self.now",
           "torque that is off passes for torque that is on",
           ("servo_sync_read", "dynamixel_care", "dynamixel_faults")),
    Mutant("drivers/serial/port.py", "if self._poll(0):", "if False:",
           "bytes from before a request are taken for its answer", ("serial_port",)),
    Mutant("drivers/plausibility.py", "if len(odd) < AGREEING:", "if len(odd) < 0:",
           "one position out of reach is believed at once", ("plausibility",)),
    Mutant("drivers/dynamixel/protocol.py", ".replace(STUFFED, RAW)", "",
           "stuffed bytes of an answer stay in it", ("dynamixel_packets",)),
    Mutant("drivers/feetech/protocol.py", "raw[at + 2] == 0xFF:", "raw[at + 2] == 0xFE:",
           "three FF in a row begin a packet of the wrong servo", ("feetech_packets",)),
    Mutant("drivers/multi_bus.py", "if goal != goal:", "if False:",
           "NaN goes to the buses before the one that refuses it", ("mixed_bus", "bus_kinds", "bus_kinds_lost")),
)  # fmt: skip
