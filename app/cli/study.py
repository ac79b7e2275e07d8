"""Commands about studies. Heavy imports stay inside the commands."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from app.cli.terminal import checked_database, console, fail, progress_bar, read_settings

if TYPE_CHECKING:
    from app.config import Settings
    from app.storage.database import Database
    from app.storage.tables import Method, Study
    from app.study.offline.batch import Plan
    from app.study.offline.sampling import Sampling
    from app.study.simulated.workplace import Workplace
    from app.study.studies import Studies

study_cli = typer.Typer(no_args_is_help=True, help="Studies of how people register objects.")

Part = Annotated[str | None, typer.Option(help="Only trials of this one.")]
TOLD_FROM_SECONDS = 120.0
"""That a batch will take: from there on it says so before it begins."""
StudyName = Annotated[str, typer.Argument(metavar="STUDY", help="Name of the study.")]


@study_cli.command("list")
def list_studies() -> None:
    """Print all studies, with how far their participants have come."""
    from sqlalchemy import select

    from app.storage.tables import Study

    settings = read_settings()
    database = checked_database(settings)
    with database.read() as session:
        rows = session.scalars(select(Study).order_by(Study.id)).all()
    studies = _studies(settings, database)
    for row in rows:
        standings = studies.progress(row.id)
        done, total = sum(one.done for one in standings), sum(one.total for one in standings)
        about = f"simulated, {row.state}" if row.is_simulated else row.state
        console.print(
            f"{row.name} ({about}): {len(standings)} participants, {done} of {total} tasks submitted"
        )


@study_cli.command("simulate")
def simulate_study(
    name: Annotated[str, typer.Argument(metavar="STUDY", help="Its name; a study that stopped goes on.")],
    operators: Annotated[int, typer.Option(min=1, max=500, help="Novices, and as many experts.")] = 8,
    scenes: Annotated[int, typer.Option(min=1, help="With known poses; of all datasets in turn.")] = 4,
    seed: Annotated[int, typer.Option(min=0, help="Of the order of tasks, and of the operators.")] = 0,
) -> None:
    """Make a study, or go on with it: simulated operators, novices and experts, do all of it by hand."""
    settings = read_settings()
    database = checked_database(settings)
    study = _find(database, name)
    if study is not None and not study.is_simulated:
        fail(f"the study {name!r} is one of people; choose another name")
    with _workplace(settings, database) as workplace:
        from app.access.auth import LOCAL_ADMINISTRATOR, Auth
        from app.storage.roles import Role
        from app.study.simulated.simulation import create_simulated, plan_of, simulate

        if study is not None:
            console.print(
                f"Study {name} goes on as it was set up, whatever --operators, --scenes and --seed say."
            )
        else:
            plan = plan_of(database, operators, scenes)
            owner = Auth(database).ensure_user(LOCAL_ADMINISTRATOR, Role.ADMIN)
            study = create_simulated(workplace, name, plan, seed, owner.id)
        with _told("simulating") as on_progress:
            simulate(workplace, study.id, on_progress)
    console.print(f"Study {name}: all simulated operators are done.")


@study_cli.command("snap")
def snap_study(
    name: StudyName,
    method: Annotated[
        Literal["default", "paper"],
        typer.Option(help="What the snaps are computed with; paper: the particle filter."),
    ] = "default",
    every: Annotated[
        float | None,
        typer.Option(min=0.0, help="Least seconds between two snapped poses; 2 with paper, else 0."),
    ] = None,
    moved_mm: Annotated[
        float | None,
        typer.Option(min=0.0, help="Least movement between them, unless turned; 5 with paper, else 0."),
    ] = None,
    moved_deg: Annotated[
        float | None,
        typer.Option(min=0.0, help="Least turn between them, unless moved; 5 with paper, else 0."),
    ] = None,
) -> None:
    """Compute a snap from every pose that the operators of STUDY passed through, as far as it is missing."""
    sampling = _sampling(method, every, moved_mm, moved_deg)
    settings = read_settings()
    database = checked_database(settings)
    study = _existing(database, name)
    with _workplace(settings, database) as workplace:
        from app.study.offline.batch import OfflineBatch
        from app.study.offline.samples import registrations_of
        from app.study.offline.snap_store import SnapStore

        registrations = registrations_of(database, study.id)
        batch = OfflineBatch(database, workplace.data, workplace.snapper, method, sampling)
        with _told("snapping") as on_progress:
            summary = batch.run(registrations, on_progress, lambda plan: _print_plan(plan, sampling))
        seconds = SnapStore(database).median_seconds(registrations, method)
    took = f" A snap took {seconds:.2g} s (median)." if summary.samples else ""
    console.print(
        f"Study {name}: {summary.samples} sampled poses, {summary.computed} snaps computed,"
        f" {summary.failed} failed.{took}"
    )


def _sampling(
    method: "Method", every: float | None, moved_mm: float | None, moved_deg: float | None
) -> "Sampling":
    """What suits the method, with what was asked for in its place."""
    from dataclasses import replace
    from math import radians

    from app.study.offline.sampling import SAMPLINGS

    given = {
        "seconds": every,
        "translation": None if moved_mm is None else moved_mm / 1000,
        "rotation": None if moved_deg is None else radians(moved_deg),
    }
    return replace(SAMPLINGS[method], **{name: value for name, value in given.items() if value is not None})


def _print_plan(plan: "Plan", sampling: "Sampling") -> None:
    if plan.chosen < plan.sampled:
        console.print(f"{plan.chosen} of {plan.sampled} sampled poses are chosen, {sampling}.")
    if plan.seconds >= TOLD_FROM_SECONDS:
        console.print(
            f"{plan.snaps} snaps are to be computed, which will take about {_duration(plan.seconds)}. It may"
            f" be stopped at any time; the same command goes on."
        )


def _duration(seconds: float) -> str:
    """Roughly, in words."""
    minutes = round(seconds / 60)
    return f"{minutes} minutes" if minutes < 120 else f"{seconds / 3600:.1f} hours"


@study_cli.command("report")
def report_study(
    name: StudyName,
    out: Annotated[Path, typer.Option(file_okay=False, help="Folder to write into.")],
    group: Part = None,
    mode: Part = None,
    condition: Part = None,
    scene: Part = None,
    object: Part = None,
    snap_seconds: Annotated[float, typer.Option(min=0.0, help="That each snap is charged with.")] = 0.1,
    paper_seconds: Annotated[float, typer.Option(min=0.0, help="The same, by the paper's filter.")] = 7.0,
    without_idle: Annotated[bool, typer.Option("--without-idle", help="Leave idle time out.")] = False,
    reference: Annotated[
        bool,
        typer.Option("--reference", help="Given poses are the truth, not the mean of what was registered."),
    ] = False,
) -> None:
    """Write the report of STUDY, or of a part of it: figure, tables, and a page that opens anywhere."""
    from app.analysis.report.report import ReportConfig, study_report
    from app.analysis.report.report_files import write_report
    from app.analysis.study_data.collect import TruthSource
    from app.analysis.study_data.selection import Selection

    database = checked_database(read_settings())
    study = _existing(database, name)
    truth: TruthSource = "reference" if reference else "operators"
    config = ReportConfig(snap_seconds, without_idle, truth, paper_seconds=paper_seconds)
    part = Selection(group, mode, condition, scene, object)
    with progress_bar() as progress:
        progress.add_task("reading the log", total=None)
        report = study_report(database, study.id, config, part)
    try:
        paths = write_report(report, out)
    except OSError as error:
        fail(f"cannot write into {out}: {error.strerror}; choose another folder with --out")
    for path in paths:
        console.print(str(path))


@study_cli.command("erase")
def erase_participant(
    name: StudyName, code: Annotated[str, typer.Argument(metavar="CODE", help="Of the participant.")]
) -> None:
    """Delete all that participant CODE of STUDY did and answered."""
    from sqlalchemy import select

    from app.storage.tables import Participant

    settings = read_settings()
    database = checked_database(settings)
    study = _existing(database, name)
    with database.read() as session:
        participant = session.scalar(select(Participant).filter_by(study_id=study.id, code=code))
    if participant is None:
        fail(f"the study {name!r} has no participant {code!r}")
    _studies(settings, database).erase(participant.id)
    console.print(f"All that {code} did and answered is erased.")


@contextmanager
def _workplace(settings: "Settings", database: "Database") -> "Iterator[Workplace]":
    """Workers, and what they work on; whoever presses Ctrl-C is told that nothing is lost."""
    from app.workers.pool import create_snapper

    snapper = create_snapper(settings)
    try:
        from app.datasets.scene_data import SceneData
        from app.storage.named_files import open_store
        from app.study.simulated.workplace import Workplace

        yield Workplace(database, SceneData(open_store(settings.files_dir, database)), snapper)
    except KeyboardInterrupt:
        fail("stopped; what was done is stored, and the same command goes on from there")
    finally:
        snapper.close()


@contextmanager
def _told(what: str) -> Iterator[Callable[[int, int], None]]:
    with progress_bar() as progress:
        task = progress.add_task(what, total=None)

        def tell(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total, description=f"{what} {done} of {total}")

        yield tell


def _studies(settings: "Settings", database: "Database") -> "Studies":
    from app.datasets.scene_data import SceneData
    from app.storage.named_files import open_store
    from app.study.studies import Studies

    return Studies(database, SceneData(open_store(settings.files_dir, database)))


def _find(database: "Database", name: str) -> "Study | None":
    from sqlalchemy import select

    from app.storage.tables import Study

    with database.read() as session:
        return session.scalar(select(Study).filter_by(name=name))


def _existing(database: "Database", name: str) -> "Study":
    study = _find(database, name)
    if study is None:
        fail(f"there is no study {name!r}; `snap6d study list` names those that are there")
    return study
