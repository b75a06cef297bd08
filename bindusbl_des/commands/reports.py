"""The command `report`: pages made again from the folders of runs and campaigns."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .console import RunFailed, refuse

if TYPE_CHECKING:
    from ..result import Result

PAGE = "report.html"


@click.command()
@click.argument("folders", metavar="DIR...", nargs=-1, required=True)
@click.option("--out", metavar="FILE", help="Where to write the page (default DIR/report.html).")
@click.option("--force", is_flag=True, help="Replace the file of --out if it exists.")
def report(folders: tuple[str, ...], out: str | None, force: bool) -> None:
    """Write the HTML report of a run again.

    The page is one file that opens offline.  Without --out it is DIR/report.html.
    """
    path = Path(out) if out else Path(folders[0]) / PAGE
    if out:
        _check_page(path, force)
    from ..report.run_page import run_page

    page = run_page(_result(folders[0]))
    _write(path, page)
    click.echo(path)


def _result(folder: str) -> "Result":
    from ..result import load_result

    try:
        return load_result(folder)
    except (OSError, ValueError) as error:
        refuse(str(error))


def _check_page(path: Path, force: bool) -> None:
    if path.is_dir():
        refuse(f"{path}: is a folder; name a file, such as {path / PAGE}")
    if path.exists() and not force:
        refuse(f"{path}: exists; use --force to replace it, or name another file")
    if not path.absolute().parent.is_dir():
        refuse(f"{path}: the folder {path.parent} does not exist")


def _write(path: Path, page: str) -> None:
    """Write a page beside its name and rename it, so that none is ever half there."""
    draft = path.with_name(f".{path.name}.tmp")
    try:
        draft.write_text(page, encoding="utf-8")
        draft.replace(path)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise RunFailed(f"{path}: cannot be written ({error.strerror})") from error
