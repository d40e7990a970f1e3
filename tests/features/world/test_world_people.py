"""People of a world are bodies: limbs keep their lengths, and nothing jumps."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from world_scripts import WORLDS, read, shipped_world

from gazerig.features.world.body_motion import SEGMENTS
from gazerig.features.world.figure import Figures
from gazerig.features.world.rotations import unit
from gazerig.features.world.timeline import HEAD_M
from gazerig.features.world.world_scene import WorldScene
from gazerig.gaze.types import Floats

STEP_S = 0.02


@cache
def figures(name: str) -> Figures:
    return Figures(shipped_world(name), 3)


class Film(NamedTuple):
    """A round of a world every 20 ms: places (n, segments, 3), rotations (n, segments, 3, 3)."""

    p_m: Floats
    R: Floats


@cache
def film(name: str) -> Film:
    from scipy.spatial.transform import Rotation

    round_s = figures(name).script.round_s
    found = [figures(name).segments(t_s) for t_s in np.arange(0.0, round_s, STEP_S).tolist()]
    quats = np.array([one.quat for one in found])
    turns = Rotation.from_quat(quats.reshape(-1, 4), scalar_first=True).as_matrix()
    return Film(np.array([one.p_m for one in found]), turns.reshape(*quats.shape[:2], 3, 3))


def people(name: str) -> list[str]:
    return list(figures(name).script.people)


def places(name: str, segment: str) -> Floats:
    return film(name).p_m[:, figures(name).row[segment]]


def turns(name: str, segment: str) -> Floats:
    return film(name).R[:, figures(name).row[segment]]


def angles_deg(a: Floats, b: Floats) -> Floats:
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1.0, 1.0)))


@pytest.mark.parametrize("name", WORLDS)
def test_limbs_keep_their_lengths(name):
    for who in people(name):
        body = figures(name).measures[who]
        for side in ("left", "right"):
            for limb in ("upper_arm forearm", "forearm hand", "thigh shank", "shank foot"):
                a, b = limb.split()
                ends = [places(name, f"{who}/{side}_{part}") for part in (a, b)]
                found = np.linalg.norm(ends[0] - ends[1], axis=1)
                assert np.abs(found - getattr(body, f"{a}_m")).max() <= 2e-3, (who, side, a)


@pytest.mark.parametrize("name", WORLDS)
def test_nothing_jumps_also_where_a_round_begins_again(name):
    around = np.concatenate((film(name).p_m, film(name).p_m[:1]))
    moved = np.linalg.norm(np.diff(around, axis=0), axis=2).max(axis=0)
    for segment, away_m in zip(figures(name).names, moved.tolist(), strict=True):
        fast = segment.endswith(("hand", "forearm"))
        most_m_s = 9.0 if fast else 6.0 if segment.endswith("foot") else 5.0
        assert away_m < most_m_s * STEP_S, segment


LARGEST_DEG = """
head torso x 85; head neck x 50; left_eye head x 45; right_eye head x 45
left_upper_arm left_forearm z 151; left_forearm left_hand z 56; left_thigh left_shank z 151
right_upper_arm right_forearm z 151; right_forearm right_hand z 56; right_thigh right_shank z 151
"""
"""Two segments, the axis of both, and the largest angle between them."""


@pytest.mark.parametrize("name", WORLDS)
def test_joints_stay_within_what_people_can_do(name):
    for who in people(name):
        R = {segment: turns(name, f"{who}/{segment}") for segment in SEGMENTS}
        for row in LARGEST_DEG.strip().replace("\n", ";").split(";"):
            one, other, axis, most = row.split()
            k = "xyz".index(axis)
            found = angles_deg(R[one][:, :, k], R[other][:, :, k])
            assert found.max() <= float(most), (who, row, found.argmax() * STEP_S)
        assert R["head"][:, 2, 0].max() <= 0.5  # 30 deg up
        speed = np.gradient(places(name, f"{who}/pelvis")[:, :2], STEP_S, axis=0)
        walks = np.linalg.norm(speed, axis=1) > 0.5
        aside = angles_deg(unit(speed), R["pelvis"][:, :2, 0])
        assert np.where(walks, aside, 0.0).max() <= 45.0, who  # people walk ahead
        for side in ("left", "right"):
            # A knee bends to the back alone.
            thigh, shank = R[f"{side}_thigh"][:, :, 0], R[f"{side}_shank"][:, :, 2]
            assert (thigh * shank).sum(axis=1).min() > -0.02, who


@pytest.mark.parametrize("name", WORLDS)
def test_a_foot_that_stands_does_not_slide(name):
    for who in people(name):
        ankle_m = figures(name).measures[who].ankle_m
        for foot in ("left_foot", "right_foot"):
            below = turns(name, f"{who}/{foot}") @ np.array((0.115, 0.0, -ankle_m))
            balls = places(name, f"{who}/{foot}") + below
            height = balls[:, 2] + figures(name).script.neck_height_m
            assert height.min() > -0.004
            stands = (height[1:] < 0.003) & (height[:-1] < 0.003)
            slid_m = np.linalg.norm(np.diff(balls[:, :2], axis=0), axis=1)[stands]
            assert slid_m.max() < 0.012 and slid_m.mean() < 0.0005, (who, foot)


def test_a_boxer_s_fist_goes_to_the_head_and_spins_only_then():
    scene = WorldScene("boxing", Figures(shipped_world("boxing"), 3))
    assert scene.behaviours
    first = next(event for event in scene.events() if event.name == "punch")
    fists = [
        next(one for one in scene.things(t_s) if one.id == 0)
        for t_s in np.arange(first.start_s, first.end_s, 0.02).tolist()
    ]
    away = [float(np.linalg.norm(np.subtract(one.p_world_m, HEAD_M))) for one in fists]
    assert away[0] > 0.55 and min(away) < 0.38
    assert max(abs(one.spin_rad_s) for one in fists) > 3.0
    quiet = [one.spin_rad_s for one in scene.things(1.0)]
    assert max(map(abs, quiet)) < 0.5


# --- Every act moves the limbs as it always has


SCRIPT = """
round_s: 35.0
places: {ring: {x_m: 0.7, y_m: -0.5, facing_deg: 150.0}}
things: {cup: {held_by: anna}}
people:
  anna:
    start: behind
    stature_m: 1.62
    acts:
      - {at_s: 0.5, do: look_at, to: ben}
      - {at_s: 1.0, do: wave}
      - {at_s: 2.0, do: speak}
      - {at_s: 4.0, do: gesture}
      - {at_s: 4.2, do: nod}
      - {at_s: 7.2, do: point, to: window, side: left}
      - {at_s: 8.0, do: look_at, to: head}
      - {at_s: 9.6, do: pass, to: ben, thing: cup}
      - {at_s: 12.2, do: shake}
      - {at_s: 12.6, do: step, ahead_m: 0.4, left_m: 0.2}
      - {at_s: 13.8, do: turn, to: window}
      - {at_s: 15.2, do: step, to: behind}
      - {at_s: 16.4, do: walk, to: chair_right, speed_m_s: 1.4}
      - {at_s: 21.5, do: sit}
      - {at_s: 23.4, do: reach, to: head}
      - {at_s: 26.5, do: stand}
      - {at_s: 28.4, do: walk, to: behind, via: [front], speed_m_s: 1.4}
  ben:
    start: chair_left
    looks_at: anna
    acts:
      - {at_s: 12.6, do: pass, to: anna, side: left, thing: cup}
      - {at_s: 16.0, do: wave, side: left}
  rex:
    start: ring
    gloves: true
    looks_at: window
    stature_m: 1.85
    acts:
      - {at_s: 0.0, do: guard, for_s: 9.0}
      - {at_s: 1.0, do: punch, to: head}
      - {at_s: 2.0, do: feint, side: left}
      - {at_s: 3.0, do: push, to: head}
      - {at_s: 5.5, do: open_guard}
      - {at_s: 10.0, do: punch, to: ben, side: left}
      - {at_s: 11.0, do: step, to: ring}
      - {at_s: 12.5, do: guard}
"""
POSES = """
0.2 rex/left_hand 4431 -5161 820 9302 2751 1003 2212
0.2 rex/right_eye 6383 -4004 7378 1104 -1561 156 9814
0.6 anna/head 17218 230 5150 72 1314 10 -9913
0.6 anna/right_eye 16572 525 5456 2629 -1927 -181 9452
0.7 rex/head 6580 -4603 6899 3409 5 -2 9401
0.7 rex/left_foot 4983 -5293 -8778 2334 0 0 9724
0.7 rex/left_hand 3824 -3565 4114 2694 9446 1596 983
0.7 rex/pelvis 7016 -5003 -104 3091 -125 41 9509
0.7 rex/right_hand 6125 -2420 4114 976 -4841 8267 -2697
0.7 rex/right_shank 7441 -3776 -4612 3262 -2017 395 9227
0.7 rex/torso 6982 -4979 1468 4225 -476 222 9049
0.75 anna/head 17216 243 5150 119 -1336 16 9910
1.04 anna/left_lid 16487 259 5445 1741 -4919 1011 8471
1.15 rex/right_hand 4134 -1723 3328 6256 -776 6878 -3598
1.2 rex/torso 6894 -4927 1467 2230 -938 216 9701
1.25 anna/right_hand 13765 2719 2691 3992 -4078 8193 -554
1.27 rex/right_forearm 6095 -1049 2475 2253 -7495 1969 -5905
1.27 rex/right_hand 3464 -1333 3018 8151 507 5085 -2730
1.27 rex/torso 6887 -4922 1467 2092 -967 208 9729
1.4 anna/head 17175 265 5150 2101 -1344 292 9680
1.45 rex/right_hand 4551 -1899 3514 4612 -2122 7667 -3930
1.7 anna/head 17164 246 5150 2148 -1335 297 9670
1.7 anna/left_eye 16451 244 5448 2658 -1750 336 9474
1.7 anna/right_hand 15008 3358 4728 29 538 -9971 538
2.1 rex/left_hand 2579 -3946 4509 2694 9446 1596 983
2.15 rex/left_hand 2261 -4058 4614 2694 9446 1596 983
2.3 anna/right_forearm 15495 3912 2690 2613 -9247 2756 -269
2.3 anna/right_hand 15036 2804 4729 29 -538 9971 538
2.5 anna/left_lid 16483 243 5448 2061 -1641 351 9640
2.6 anna/lips 16621 526 4650 2117 -1400 306 9668
3.1 anna/head 17188 257 5148 2216 -1324 304 9656
3.1 anna/lips 16615 534 4654 2216 -1324 304 9656
3.3 rex/right_hand 3723 -1055 2936 1885 -2794 9191 -2040
3.5 anna/lips 16578 477 4696 2047 -1227 259 9708
3.5 anna/right_hand 14204 1793 1127 5926 -6200 4270 -2864
3.9 rex/right_hand 1670 -384 1100 3725 1466 9162 -202
3.9 rex/torso 6750 -4828 1440 3064 -3537 1238 8750
4.05 rex/left_hand 3772 -2981 3959 2582 9240 2531 1247
4.05 rex/right_hand 1004 -165 1100 4712 1417 8694 -463
4.25 anna/left_hand 15245 -1984 -522 6689 2674 2145 6596
4.4 rex/right_hand 935 -141 1156 5175 1274 8422 -810
4.7 anna/head 17317 235 5162 2223 -531 121 9735
4.7 anna/left_hand 14786 -1337 995 3376 7254 3706 4717
4.7 anna/lips 16677 543 4754 2223 -531 121 9735
4.8 rex/right_hand 5052 -1696 3645 1321 -4247 8600 -2501
4.9 anna/lips 16690 509 4586 2070 -2200 478 9521
5.0 ben/head 11866 4494 2356 7035 -1027 -1038 -6956
5.0 ben/left_foot 8193 2103 -8829 2292 0 0 -9734
5.0 ben/left_hand 9256 2511 -3000 7535 367 6564 -33
5.0 ben/left_shank 8260 1532 -4637 2547 96 675 -9646
5.0 thing/cup 14126 1984 2012 0 0 0 10000
5.5 anna/left_hand 14743 -1476 1162 3376 7254 3706 4717
5.5 anna/neck 17459 240 4053 859 -1120 97 9899
5.5 anna/right_forearm 16986 3132 1028 2770 -6800 493 -6771
5.5 anna/right_hand 14743 2398 861 3376 -7254 3706 -4717
5.7 rex/left_hand 2876 -4159 2539 5157 8030 2699 1284
6.2 rex/head 6730 -4758 6917 3408 -16 6 9401
6.2 rex/left_hand 3109 -5437 1624 6553 6867 2886 1252
6.2 rex/right_hand 8120 -1239 1624 3248 -2197 7118 -5828
6.2 rex/torso 6961 -4946 1469 4229 -238 111 9058
6.75 rex/right_hand 6206 -1243 3196 1659 -3866 8194 -3894
6.8 anna/left_hand 15698 -1832 -1024 7339 1560 1467 6447
6.85 rex/left_hand 3720 -3553 4056 2769 9415 1640 1003
7.35 anna/left_hand 16502 -2342 -963 7889 70 931 6074
7.35 anna/right_hand 14442 1875 929 5931 -6135 4090 -3235
7.6 anna/left_hand 16313 -5300 2454 6266 -4116 4206 5110
8.1 anna/head 17171 192 5149 2293 -1337 318 9636
8.2 anna/head 17178 183 5149 2234 -1333 309 9651
8.2 anna/left_forearm 16862 -4315 2783 4002 -6139 -5561 -3922
8.2 anna/left_hand 16776 -6509 3663 5317 -4949 4986 4730
8.2 anna/torso 17381 147 439 998 -98 10 9950
8.3 anna/left_eye 16477 113 5450 30 1216 -485 -9914
8.4 anna/right_eye 16621 565 5453 330 -1349 198 9901
8.5 rex/head 6574 -4591 6900 3421 25 -9 9397
8.8 rex/right_hand 7643 -2729 821 4277 -997 2753 -8552
9.0 rex/right_hand 8356 -2890 -709 4514 -168 725 -8892
9.1 anna/left_hand 15959 -3713 668 7610 -1654 2630 5696
10.0 anna/right_hand 13668 1878 1277 5634 -5628 4269 -4284
10.15 rex/left_hand 7502 -851 2192 6925 4625 759 -5484
10.2 anna/left_hand 16944 -1917 -1459 7852 459 586 6147
10.3 rex/left_hand 8313 236 3865 4139 5729 2557 -6596
10.3 rex/torso 6937 -4895 1467 6117 -763 595 7852
10.45 rex/left_hand 6740 -2042 1436 9056 3481 -626 -2343
10.45 rex/pelvis 6995 -4951 -104 3410 -171 62 9399
10.5 ben/left_hand 13914 2250 873 3352 -5103 -7785 1459
10.5 rex/torso 6961 -4925 1468 4645 -516 272 8836
10.7 thing/cup 13904 1496 1573 1049 0 0 9945
10.8 anna/pelvis 17366 197 -938 0 -34 0 10000
10.8 anna/right_hand 14744 1900 1657 5172 -4713 4703 -5378
10.85 thing/cup 14269 2341 1641 7191 0 0 -6949
11.1 anna/head 17137 207 5149 55 1332 7 -9911
11.1 anna/torso 17375 208 439 0 -140 0 9999
11.2 anna/right_hand 14756 1906 1656 5178 -4720 4696 -5371
11.2 ben/left_hand 13915 2262 870 3319 -5093 -7775 1610
11.3 rex/pelvis 7012 -5039 -104 3091 -125 41 9509
11.3 rex/right_foot 9017 -4707 -8778 4230 0 0 9061
11.5 rex/left_foot 4983 -5293 -8778 2334 0 0 9724
11.7 anna/right_hand 15498 2237 -640 7282 -1472 1690 -6477
12.0 thing/cup 8767 2483 -1967 1803 0 0 -9836
12.9 anna/head 16282 -335 4835 718 1304 95 -9888
12.9 anna/left_eye 15692 -729 5142 149 -1073 -212 9939
12.9 anna/left_foot 13882 -2537 -8646 2143 -440 -97 -9757
13.0 anna/head 15627 -664 4780 869 1341 118 -9871
13.0 anna/neck 15874 -647 3682 349 1106 39 -9932
13.1 anna/right_foot 17309 1044 -8633 464 -449 21 9979
13.3 anna/left_hand 13669 -3713 -1476 7862 367 469 6151
13.3 anna/right_foot 13932 -570 -8410 907 0 0 -9959
13.3 anna/right_shank 12545 -756 -4679 349 1776 174 -9833
13.8 ben/head 11842 4491 2357 6490 -1113 -968 -7463
13.8 ben/left_hand 11626 1442 832 2426 4393 7704 3933
13.8 thing/cup 11084 916 1475 9940 0 0 1095
13.95 thing/cup 11375 201 1645 899 0 0 -9959
14.2 anna/right_foot 13097 -969 -8868 1244 0 0 -9922
14.2 ben/left_hand 11707 1397 839 2180 4285 7790 4026
14.4 anna/head 13174 -1871 5118 866 -1653 146 9823
14.4 anna/left_foot 14020 -2431 -8868 4247 0 0 -9053
14.4 anna/pelvis 13413 -1769 -963 4128 28 13 -9108
14.4 anna/right_eye 12576 -1456 5378 1051 -1610 110 9813
14.9 anna/right_hand 11768 -4790 646 6475 -7198 -1534 1976
15.0 thing/cup 12727 -5356 658 7203 0 0 -6937
15.7 anna/left_foot 15762 -1484 -8736 5029 0 0 -8644
16.2 ben/left_hand 8880 1481 -1603 6156 -255 7875 164
16.8 ben/left_hand 10941 100 1797 383 1190 -9799 -1553
16.8 ben/right_hand 8587 4250 -3000 7033 -2672 6007 2703
17.1 anna/right_lid 16466 351 5445 35 -5071 21 8619
17.9 anna/left_foot 13376 -4661 -8868 4072 0 0 -9134
17.9 anna/left_hand 15763 -4200 -1507 5121 -122 -402 8579
17.9 anna/left_shank 13477 -4580 -4885 3801 -157 -46 -9248
17.9 anna/pelvis 13748 -3146 -1092 3610 23 9 -9326
17.9 anna/right_foot 14856 -920 -8689 3100 541 177 -9490
18.4 ben/left_hand 8717 1863 -1602 6189 127 7823 -697
18.5 anna/right_foot 9490 -5808 -8868 3138 0 0 -9495
19.1 anna/left_shank 6980 -9944 -4932 876 768 145 -9931
19.1 anna/pelvis 7129 -9127 -969 414 34 1 -9991
19.1 anna/right_foot 7704 -7164 -8343 3877 0 0 9218
19.1 anna/right_lid 6751 -8291 5333 4711 -1691 925 8608
19.2 ben/head 11762 4460 2358 5705 -755 -527 -8161
19.2 ben/left_lid 11898 3928 2921 5487 2355 1646 -7851
20.0 rex/left_hand 3864 -3597 4114 2694 9446 1596 983
20.9 anna/left_foot 7546 -3808 -8868 1309 0 0 9914
22.1 anna/left_foot 7546 -3808 -8868 1309 0 0 9914
22.3 anna/left_shank 6343 -3572 -5077 1288 -1555 99 9793
22.3 anna/pelvis 9533 -3603 -2484 1797 -757 139 9807
22.3 anna/right_hand 5397 -324 -1182 5291 -5347 5077 -4200
22.3 anna/torso 9335 -3528 -1123 1718 -2982 547 9373
22.9 anna/left_foot 7546 -3808 -8868 1309 0 0 9914
23.65 anna/right_hand 6755 -1322 -1221 5667 -4598 5749 -3701
23.8 anna/right_hand 5339 -1193 -60 5906 -3286 6635 -3208
24.9 anna/left_hand 8803 -4837 -3000 7268 2058 6244 -1988
24.9 anna/right_hand 4458 -1032 601 5728 -1774 7395 -3059
24.9 anna/right_shank 8435 -1738 -4913 2568 183 590 9645
24.9 anna/torso 11377 -4323 -2795 761 -3475 283 9341
25.2 ben/left_lid 12060 3811 2787 6638 2307 2271 -6743
25.8 anna/torso 11440 -4368 -2782 1149 -2194 260 9685
25.9 anna/right_hand 6212 -1287 -732 5787 -4202 6047 -3506
26.0 anna/left_foot 7546 -3808 -8868 1309 0 0 9914
26.0 anna/pelvis 11586 -4417 -4150 1760 -101 18 9843
26.0 anna/right_hand 7388 -1420 -1782 5532 -4915 5485 -3893
26.0 anna/torso 11559 -4407 -2773 1659 -406 68 9853
27.0 anna/right_foot 8174 -2154 -8868 2292 0 0 9734
27.3 anna/pelvis 9930 -3743 -2863 1798 -748 137 9808
27.3 anna/right_hand 5816 -471 -1547 5291 -5347 5077 -4200
27.9 anna/right_hand 5465 -365 782 5291 -5347 5077 -4200
29.5 anna/right_foot 7376 -2948 -8145 4257 1381 659 -8918
30.2 anna/left_foot 9123 132 -8515 8899 471 -944 4438
30.2 anna/pelvis 8003 -4508 -2013 8751 -16 29 4840
30.2 anna/right_shank 9625 -4327 -5825 8523 -1832 2932 3925
31.0 anna/left_foot 11201 2415 -7992 8983 -780 1779 3940
32.4 anna/left_hand 19735 14 -1541 4370 -120 -563 8976
32.4 anna/pelvis 17458 569 -1159 4386 14 7 -8987
32.4 anna/right_foot 17449 3811 -8600 5822 641 461 -8092
33.0 ben/right_eye 11552 4106 2965 8662 -1639 -1374 -4517
33.1 anna/right_foot 17400 1085 -8868 500 0 0 9988
34.4 anna/right_eye 16504 452 5450 221 1467 -24 -9889
34.4 ben/left_lid 12109 4090 2970 6937 -1476 -1486 -6892
34.7 rex/right_hand 6826 -2546 2582 1729 -4147 7678 -4568
"""
"""Time in s, segment, its place and quaternion (its first part > 0) in ten-thousandths."""


def test_an_act_moves_every_limb_as_it_was_pinned(tmp_path):
    """Pinned, not derived: pin anew in the commit that moves a body otherwise on purpose."""
    path = tmp_path / "all_acts.yaml"
    path.write_text(SCRIPT)
    found = Figures(read(path), 2)
    for row in POSES.strip().splitlines():
        t_s, name, *pinned = row.split()
        (p_m, quat), at = found.segments(float(t_s)), found.row[name]
        now = 1e4 * np.array([*p_m[at], *quat[at] * np.sign(quat[at][0])])
        assert np.abs(now - np.array(pinned, float)).max() < 1.0, row


# --- People of a world keep out of its furniture and of each other


_BETWEEN_M = 0.03
"""Shapes that collide are a little larger than what is seen; hands may touch."""


@pytest.mark.parametrize("name", WORLDS)
def test_people_stay_out_of_the_furniture_and_of_each_other(mujoco, name):
    from gazerig.features.world.figure_model import PeoplePlacer
    from gazerig.features.world.model import world_spec

    world = figures(name)
    model = world_spec(world, None).compile()
    data, people = mujoco.MjData(model), PeoplePlacer(model, world)
    owners = [model.body(int(body)).name for body in model.geom_bodyid]
    solid = [i for i in range(model.ngeom) if model.geom_contype[i] and "/" in owners[i]]
    room = [i for i in range(model.ngeom) if owners[i] in ("room", "stand")]
    whose = np.array([one.split("/")[0] for one in owners])
    bound = model.geom_rbound
    half_m = 3.4 if world.script.room == "hall" else 2.6
    for t_s in np.arange(0.3, world.script.round_s, 1.31).tolist():
        people.place(data, t_s)
        mujoco.mj_kinematics(model, data)
        seen = [i for i in solid if abs(data.geom_xpos[i, 1]) < half_m]
        for k, one in enumerate(seen):
            others = np.array([*room, *seen[:k]])
            others = others[whose[others] != whose[one]]
            apart = np.linalg.norm(data.geom_xpos[others] - data.geom_xpos[one], axis=1)
            for other in others[apart < bound[one] + bound[others]].tolist():
                found = mujoco.mj_geomDistance(model, data, one, other, 0.1, None)
                names = owners[one], owners[other], t_s
                assert found > -_BETWEEN_M or "hand" in names[0] + names[1], names
