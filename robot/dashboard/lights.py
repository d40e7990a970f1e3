"""Light and floor of the page's scene: a key light, a fill, light from behind, a soft round floor.

No light throws a shadow and none is a room's picture: shadows cost a browser without a graphics
card three quarters of its rate, and a picture would fade the scene in slowly.
"""

import viser

from gazerig.robot.dashboard.glb import FLAT, glb
from gazerig.robot.dashboard.head_mesh import glow
from gazerig.robot.dashboard.head_view import FLOOR_M

_FLOOR_RADIUS_M = 0.62


def furnish(scene: viser.SceneApi) -> None:
    """Light the scene and lay its floor, which fades into any background."""
    scene.world_axes.visible = False
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.add_light_hemisphere(
        "/light/sky", sky_color=(255, 250, 244), ground_color=(186, 170, 166), intensity=2.1
    )
    # Key light from above and the head's left, where a visitor's window would be.
    scene.add_light_directional(
        "/light/key", color=(255, 244, 228), intensity=2.6, position=(0.9, 0.75, 1.25)
    )
    scene.add_light_directional(
        "/light/fill", color=(214, 228, 255), intensity=0.9, position=(0.8, -1.2, 0.25)
    )
    scene.add_light_directional(
        "/light/rim", color=(235, 242, 255), intensity=1.4, position=(-1.2, -0.5, 1.0)
    )
    scene.add_glb(
        "/floor",
        glb(glow((168, 178, 196, 96)), FLAT),
        scale=_FLOOR_RADIUS_M,
        position=(0.0, 0.0, FLOOR_M),
        cast_shadow=False,
        receive_shadow=False,
    )
