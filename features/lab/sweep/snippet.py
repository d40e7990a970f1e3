"""The best point of a fit as YAML: a layer over the rig, like a character."""

from gazerig.config.parameters import differences, flattened
from gazerig.config.schema import load_rig
from gazerig.config.text import changes_text
from gazerig.features.lab.sweep.axes import Point
from gazerig.robot.app.options import RunOptions

SNIPPET = "best.yaml"


def snippet_of(options: RunOptions, point: Point) -> str:
    """Return the values of a point as YAML that ``gazerig run RIG --character FILE`` takes.

    A run has only one character, so the changes of the runs' own character are included.
    """
    changes = dict(point)
    if options.character is not None:
        plain = load_rig(options.rig, None, options.profile)
        whole = load_rig(options.rig, options.character, options.profile)
        changes = flattened(whole, differences(plain, whole)) | changes
    return changes_text(changes)
