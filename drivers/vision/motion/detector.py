"""Detection of moving things between two images, independent of the camera's own motion.

The newer image is compared with the older one, which is turned as the joints measured. The camera's
own motion is estimated from the flow between them (ego_motion). Other motion (segmentation) is
clustered to patches (clustering). Their slide, growth and spin (patch_motion) give position and
velocity, and persistent ids (tracking). No clock is used: times come with images.

Camera frame: optical, x right, y down, z forward. With p = z (x', y', 1), where x' and y' are the
pixel divided by the focal length, the velocity is z (dx'/dt, dy'/dt, 0) + (dz/dt) (x', y', 1). A
thing that grows by a share per second approaches by that share: dz/dt = -loom z.

While the camera turns fast, and if the camera's motion cannot be separated from that of things,
nothing is reported, like human vision during a saccade.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.clustering import (
    PixelGroup,
    cluster_motion,
    fastest_quarter,
    inscribed_radius_px,
    thing_pixel,
)
from gazerig.drivers.vision.motion.ego_motion import (
    estimate_ego_motion,
)
from gazerig.drivers.vision.motion.flow import (
    Floats,
    FlowSearch,
    Plane,
    SmallImage,
    align_images,
    is_searchable,
    scale_down,
    to_original_px,
    turn_homography,
)
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.drivers.vision.motion.patch_motion import PatchMotion, blur, patch_motion
from gazerig.drivers.vision.motion.segmentation import (
    is_unchanged,
    segment_motion,
)
from gazerig.drivers.vision.motion.tracking import MotionTracks, PatchTrack

_KIND = "thing"
# Unpredicted motion of the image above which flow is computed again, as a shift blurs flow and
# loses it at the edges.
_SEARCH_AGAIN_PX = 1.5
# Smallest common share of both images, below which motions cannot be separated.
_LEAST_KNOWN = 0.4
# No motion is reported while the camera turns faster, or if a smaller share of the image's texture
# moves uniformly.
_FASTEST_TURN_DEG_S, _LEAST_BACKGROUND_SHARE = 200.0, 0.35
# Frames further apart in time are not compared.
_LONGEST_GAP_S = 0.3
# Margin at the image's edge, as a share of its width, where flow is unknown if the camera turns;
# unpredicted motion of the image above which everything there comes in at the side.
_EDGE_SHARE, _PANS_PX = 0.065, 0.5
# Distance from the edge at which a patch continues beyond it.
_CUT_PX = 1


Vec3 = tuple[float, float, float]

ASSUMED_M, _ASSUMED_SPREAD = 2.0, 0.5
"""Distance assumed for things without a measured depth; its standard deviation as a share of it."""
# A depth image has holes and, at edges, the background; a tenth of a thing must have depth.
_LEAST_SHARE, _LEAST_PIXELS = 0.1, 5
_LEAST_SD_M = 0.005
# Median absolute deviation to standard deviation.
_MAD = 1.4826


class Distance(NamedTuple):
    """Distance of a thing along the optical axis, its standard deviation, and whether measured."""

    z_m: float
    sd_m: float
    is_measured: bool


def shrink_depth(depth_m: NDArray[Any] | None, shape: tuple[int, ...]) -> Plane | None:
    """Resize a depth image to the small image's size."""
    if depth_m is None or depth_m.size == 0:
        return None
    # Nearest neighbour, as the mean of two surfaces is on neither.
    depth = cv2.resize(depth_m.astype(np.float32), shape[::-1], interpolation=cv2.INTER_NEAREST)
    return np.asarray(depth, np.float32)


def distance(group: PixelGroup, depth: Plane | None) -> Distance:
    """Return a thing's distance from the depth image, or the assumed one."""
    if depth is not None:
        values = depth[group.rows, group.columns]
        values = values[np.isfinite(values) & (values > 0.0)]
        if len(values) >= max(_LEAST_PIXELS, _LEAST_SHARE * len(group.columns)):
            z = float(np.median(values))
            spread = _MAD * float(np.median(np.abs(values - z)))
            return Distance(z, max(_LEAST_SD_M, spread), True)
    return Distance(ASSUMED_M, ASSUMED_M * _ASSUMED_SPREAD, False)


def back_project(point_px: Floats, z_m: float, K: Floats) -> Vec3:
    """Return the point at depth ``z_m`` of a pixel."""
    x, y = ((point_px - K[:2, 2]) / K[[0, 1], [0, 1]]).tolist()
    return z_m * x, z_m * y, z_m


def velocity(p_m: Vec3, flow_px_s: tuple[float, float], loom_1_s: float, K: Floats) -> Vec3:
    """Return the velocity of a thing at ``p_m`` from the motion and growth of its image."""
    x, y, z = p_m
    return (
        z * flow_px_s[0] / float(K[0, 0]) - loom_1_s * x,
        z * flow_px_s[1] / float(K[1, 1]) - loom_1_s * y,
        -loom_1_s * z,
    )


class MotionDetector:
    """Detector of motion between consecutive images; pure except for the stored last image."""

    def __init__(self, params: MotionParams) -> None:
        self._params = params
        self._search = FlowSearch()
        self._tracks = MotionTracks()
        self._gloves = None
        if params.gloves:
            from gazerig.drivers.vision.motion.gloves import GloveDetector

            self._gloves = GloveDetector()
        self._before: SmallImage | None = None
        self.no_result_reason = ""

    @property
    def before_s(self) -> float | None:
        """Return the capture time of the stored image, with which the next one is compared."""
        return None if self._before is None else self._before.captured_s

    def find(
        self,
        image: NDArray[Any],
        captured_s: float,
        lens: Intrinsics,
        R_now_before: NDArray[np.float64] | None,
        depth_m: NDArray[Any] | None = None,
    ) -> tuple[MovingBlob, ...]:
        """Find moving things between the last image and this one.

        image: (h, w, 3) BGR or (h, w) grey, uint8
        lens: focal lengths and centre in pixels of this image
        R_now_before: (3, 3) turns directions from the camera's axes at ``before_s`` into those at
            ``captured_s``; identity for a camera at rest, None if unknown
        depth_m: (any, any) distance along the optical axis, aligned with the image; 0, NaN or
            infinite if unknown
        """
        now = scale_down(image, self._params.work_px, lens, captured_s)
        before, self._before = self._before, now
        blobs, self.no_result_reason = self._compare_images(now, before, R_now_before, depth_m)
        if self._gloves is not None:
            blobs = self._gloves.add_gloves(blobs, image, captured_s, lens, self._params.work_px)
        return blobs

    def forget(self) -> None:
        """Discard the last image: the next one is the first of another scene."""
        self._before = None
        self._tracks.forget()
        if self._gloves is not None:
            self._gloves.forget()

    def _compare_images(
        self,
        now: SmallImage,
        before: SmallImage | None,
        R_now_before: Floats | None,
        depth_m: NDArray[Any] | None,
    ) -> tuple[tuple[MovingBlob, ...], str]:
        """Compare two images; return what moves, and the reason why they cannot be compared."""
        if not is_searchable(now.grey):
            return (), "frame too small"
        if before is None or before.grey.shape != now.grey.shape:
            self._tracks.forget()
            return (), "first frame"
        dt_s = now.captured_s - before.captured_s
        if not 0.0 < dt_s <= _LONGEST_GAP_S:
            return (), "no frame shortly before"
        depth = shrink_depth(depth_m, now.grey.shape)
        H = turn_homography(R_now_before, now, before)
        pair = align_images(now, before, H)
        if is_unchanged(pair):
            self._tracks.step([], [], [], H, now.captured_s, dt_s)
            return (), ""
        pair = self._search.search(pair)
        ego = estimate_ego_motion(pair, now.K, R_now_before is not None)
        pans = ego.unforeseen_px > _PANS_PX
        if (
            ego.background_share >= _LEAST_BACKGROUND_SHARE
            and ego.unforeseen_px >= _SEARCH_AGAIN_PX
        ):
            # A large unpredicted motion is removed first.
            pair = self._search.search(align_images(now, before, ego.total))
            ego = estimate_ego_motion(pair, now.K, True)
        turn = float(np.degrees(np.arctan(ego.shift_px / now.K[0, 0]))) / dt_s
        why = ""
        if not turn <= _FASTEST_TURN_DEG_S:
            why = "the camera turns too fast"
        elif pair.valid_mask.mean() < _LEAST_KNOWN:
            why = "too little of the last frame in view"
        elif ego.background_share < _LEAST_BACKGROUND_SHARE:
            why = "no common motion of the background"
        if why:  # ego-motion cannot be separated from the motion of objects
            self._tracks.predict(ego.total, now.captured_s, dt_s)
            return (), why
        groups = cluster_motion(segment_motion(pair, ego, R_now_before is None))
        soft_now, soft_before = blur(pair.fine_now), blur(pair.fine_before)
        centres = [np.array((group.columns.mean(), group.rows.mean())) for group in groups]
        motions = [
            patch_motion(group, centre, soft_now, soft_before, ego.B)
            for group, centre in zip(groups, centres, strict=True)
        ]
        follows = self._tracks.step(
            centres,
            [np.array(motion.slide_px) / dt_s for motion in motions],
            [float(np.sqrt(group.box[2] * group.box[3])) for group in groups],
            ego.total,
            now.captured_s,
            dt_s,
        )
        blobs = tuple(
            self._blob(group, motion, follow, now, depth, dt_s)
            for group, motion, follow in zip(groups, motions, follows, strict=True)
            if self._tracks.is_confirmed(follow)
        )
        if pans:
            blobs = tuple([replace(blob, from_side=False) for blob in blobs])
        return blobs, ""

    def _blob(
        self,
        group: PixelGroup,
        motion: PatchMotion,
        follow: PatchTrack,
        now: SmallImage,
        depth: Plane | None,
        dt_s: float,
    ) -> MovingBlob:
        """Combine the measurements of one thing."""
        far = distance(group, depth)
        point = thing_pixel(group, follow.centre)
        p = back_project(point, far.z_m, now.K)
        flow_px_s = motion.slide_px[0] / dt_s, motion.slide_px[1] / dt_s
        # A thing that the edge of the image cuts does not grow when more of it becomes visible.
        growth_sd = np.inf if _is_cut(group, now.grey.shape) else motion.sd
        loom = _shrink_by_noise(motion.growth, growth_sd) / dt_s
        fastest_px, fastest_flow = fastest_quarter(group)
        at = back_project(fastest_px, far.z_m, now.K)
        fx, fy = (fastest_flow / dt_s).tolist()
        (sx, sy), (x, y, width, height) = now.scale, group.box
        left, top = to_original_px((x - 0.5, y - 0.5), now.scale)
        edge_px = _EDGE_SHARE * now.grey.shape[1]
        return MovingBlob(
            follow.id,
            _KIND,
            p,
            # That of a disc with this area.
            far.z_m * float(np.sqrt(len(group.columns) / (np.pi * now.K[0, 0] * now.K[1, 1]))),
            spin_rad_s=_shrink_by_noise(motion.spin_rad, motion.sd) / dt_s,
            loom_1_s=loom,
            v_camera_m_s=velocity(p, flow_px_s, loom, now.K),
            depth_known=far.is_measured,
            depth_sd_m=far.sd_m,
            spin_sd_rad_s=motion.sd / dt_s,
            loom_sd_1_s=growth_sd / dt_s,
            box_px=(left, top, width / sx, height / sy),
            centre_px=to_original_px((float(point[0]), float(point[1])), now.scale),
            area_px=len(group.columns) / (sx * sy),
            flow_px_s=(flow_px_s[0] / sx, flow_px_s[1] / sy),
            fastest_m=at,
            fastest_m_s=velocity(at, (fx, fy), loom, now.K),
            thickness_m=2.0
            * far.z_m
            * inscribed_radius_px(group, now.grey.shape)
            / float(now.K[0, 0]),
            from_side=x <= edge_px or x + width >= now.grey.shape[1] - edge_px,
        )


def _is_cut(group: PixelGroup, shape: tuple[int, ...]) -> bool:
    """Return whether a patch continues beyond an edge of the small image."""
    x, y, width, height = group.box
    across, down = shape[1] - _CUT_PX, shape[0] - _CUT_PX
    return min(x, y) <= _CUT_PX or x + width >= across or y + height >= down


def _shrink_by_noise(value: float, sd: float) -> float:
    """Shrink a measurement towards 0 by its noise; one within the noise is 0.

    This is the positive part of the James-Stein estimator for one number. Attention uses the
    magnitude, which noise would otherwise always increase.
    """
    if value == 0.0 or not np.isfinite(sd):
        return 0.0
    return value * max(0.0, 1.0 - (sd / value) ** 2)
