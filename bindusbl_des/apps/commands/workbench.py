"""The command `workbench`: a page on this machine to draw, move, simulate, plan and look."""

from pathlib import Path

import click

from ...support.shipped import ENDINGS, located, shipped
from .console import refuse, refusing, say, talk
from .options import shipped_or_file


@click.command(short_help="Draw, move, simulate and plan on a page.")
@click.argument("where", metavar="[SCENARIO|FOLDER]", default=".", shell_complete=shipped_or_file())
@click.option(
    "--port", type=click.IntRange(0, 65535), default=0, metavar="N", help="Default: any free one."
)
@click.option("--no-browser", is_flag=True, help="Only print the address.")
def workbench(where: str, port: int, no_browser: bool) -> None:
    """Draw a survey, move vessels, simulate, plan and look, on a page of this machine.

    SCENARIO is a file, which each change is written to, or the name of one that ships, which is
    copied here; of a FOLDER it is the only scenario there, or `scenario.yaml`, which is begun; of
    that of a plan its answer, in a file beside it, and what was simulated for it.
    What is simulated and planned, and all that the scenario was, lies in the folder `workbench`
    beside it.  The page answers this machine alone, and asks the network for nothing.
    """
    from ...support.mistakes import ScenarioError
    from ..planning.folder import PlanError, is_plan_folder
    from ..workbench.server import serve

    plan = Path(where) if is_plan_folder(Path(where)) else None
    with refusing(ScenarioError, PlanError):
        file = _file(where) if plan is None else _answer(plan)

    def begun(address: str) -> None:
        say(f"{file}: {address}")
        talk("Ctrl-C ends it; what was changed and flown is kept.")
        if not no_browser:
            import webbrowser

            webbrowser.open(address)

    try:
        with refusing(ScenarioError, PlanError):
            serve(file, port, begun, plan)
    except OSError as error:
        named = f"port {port}" if error.filename is None else error.filename
        refuse(f"{named}: {error.strerror}; name another")


def _answer(plan: Path) -> Path:
    """Return the file of the team that a plan speaks of, made beside its folder if it is not there.

    Raises:
        PlanError: when nothing was flown yet, or a file cannot be used.
    """
    from ...support.files import write_text
    from ..planning.folder import drawn_team
    from ..workbench.jobs import text_of

    folder = plan.absolute()
    file = folder.with_name(f"{folder.name}-team.yaml")
    if not file.exists():
        team = drawn_team(plan)
        text = (
            f"# {team.whose} of {folder.name}: {team.team}\n{text_of(team.scenario, folder.parent)}"
        )
        write_text(file, text)
    return file


def _file(where: str) -> Path:
    """Return the scenario file that is meant, copied here where it ships.

    Raises:
        ScenarioError: when there is none of that name.
    """
    path = Path(where)
    if path.is_dir():
        found = [one for one in sorted(path.iterdir()) if one.suffix in ENDINGS]
        if len(found) > 1 and path / "scenario.yaml" not in found:
            names = ", ".join(one.name for one in found[:4])
            refuse(f"{where}: holds {len(found)} scenarios ({names}); name one of them")
        return found[0] if len(found) == 1 else path / "scenario.yaml"
    if path.suffix in ENDINGS and path.absolute().parent.is_dir():
        return path
    source = Path(located(where, ("scenarios",)))
    if where not in shipped("scenarios") or path.is_file():
        return source
    copy = Path(f"{where}.yaml")
    if not copy.exists():
        copy.write_bytes(source.read_bytes())
    return copy
