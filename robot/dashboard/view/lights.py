"""Lights of the page's scene: ambient, key and fill light.

No light throws a shadow and none is a room's picture: shadows cost a browser without a graphics
card three quarters of its rate, and a picture would fade the scene in slowly.
"""

import viser

from gazerig.robot.dashboard.view.glb import GROUND, LIGHTS, SKY, SKY_INTENSITY


def furnish(scene: viser.SceneApi) -> None:
    """Add the lights; the scene has no background, so that of the page is visible."""
    scene.world_axes.visible = False
    scene.configure_environment_map(None)
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.add_light_hemisphere(
        "/light/sky", sky_color=SKY, ground_color=GROUND, intensity=SKY_INTENSITY
    )
    # The light from behind is only for surfaces lit in advance; it does not reach the eyes' front.
    for number, light in enumerate(LIGHTS[:2]):
        scene.add_light_directional(
            f"/light/{number}",
            color=light.colour,
            intensity=light.intensity,
            position=light.position,
        )
