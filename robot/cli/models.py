"""Commands under models: a list of model files, and their download."""

from typing import Annotated

import typer
from rich.table import Table

from gazerig.drivers.errors import SetupError
from gazerig.drivers.vision.model_download import fetch
from gazerig.drivers.vision.model_files import MODEL_FILES, models_folder
from gazerig.params import unknown_text
from gazerig.robot.cli.progress import Console, progress_bar
from gazerig.robot.cli.terminal import clear_errors

app = typer.Typer()
models = typer.Typer(
    name="models",
    help="List and download model files that detect faces, people, hands and eyes.",
    no_args_is_help=True,
)
app.add_typer(models)

_NAMES = list(dict.fromkeys(file.name for file in MODEL_FILES))


@models.command("list")
def list_models() -> None:
    """List model files: what each is for, its licence, and whether it is here."""
    rows = [file._asdict() | {"state": file.state()} for file in MODEL_FILES]
    table = Table("name", "file", "purpose", "licence", "MB", "state")
    for row in rows:
        size = f"{row['size_bytes'] / 1e6:.1f}"
        table.add_row(
            *(row[key] for key in ("name", "file", "purpose", "licence")), size, row["state"]
        )
    Console().print(table)
    print(f"folder: {models_folder()}")
    if any(row["state"] != "there" for row in rows):
        print("gazerig models fetch downloads missing files")


@models.command("fetch")
def fetch_models(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help=f"Names: {', '.join(_NAMES)}; default: all.",
        ),
    ] = None,
) -> None:
    """Download model files, verify them and put them into the folder of models."""
    with clear_errors():
        if unknown := sorted({*(names or ())} - {*_NAMES}):
            raise SetupError(unknown_text("model", unknown[0], _NAMES))
        wanted = [file for file in MODEL_FILES if not names or file.name in names]
        failed = []
        with progress_bar() as progress:
            for address in dict.fromkeys(file.address for file in wanted):
                some = [file for file in wanted if file.address == address]
                try:
                    brought = fetch(some, progress)
                except SetupError as error:
                    failed.append(str(error))
                    continue
                for file in some:
                    print(
                        f"{file.name}: {file.path} {'fetched' if file in brought else 'already exists'}"
                    )
        if failed:
            raise SetupError("\n".join(failed))
