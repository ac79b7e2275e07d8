"""The command line. Heavy imports stay inside the commands: worker processes import this module too."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.study_cli import study_cli
from app.terminal import checked_database, console, fail, open_database, progress_bar, read_settings

if TYPE_CHECKING:
    from app.database import Database

cli = typer.Typer(no_args_is_help=True, add_completion=False, help="Annotate 6-DoF object poses, with help.")
token_cli = typer.Typer(no_args_is_help=True, help="API tokens for scripts and robots.")
user_cli = typer.Typer(no_args_is_help=True, help="People who may sign in.")
cli.add_typer(token_cli, name="token")
cli.add_typer(user_cli, name="user")
cli.add_typer(study_cli, name="study")

RoleOption = Annotated[str, typer.Option(help="operator, reviewer or admin.")]


def main() -> None:
    """Run the command that was typed; what goes wrong is one sentence."""
    try:
        cli()
    except Exception as error:
        if os.environ.get("SNAP6D_DEBUG"):
            raise
        fail(str(error) or type(error).__name__)


@cli.command()
def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on; 0 takes a free one.")] = None,
    state_dir: Annotated[Path | None, typer.Option(help="Database, files and exports.")] = None,
    database_url: Annotated[str | None, typer.Option(help="Another database, such as PostgreSQL.")] = None,
    scheduler_address: Annotated[str | None, typer.Option(help="A Dask scheduler to use.")] = None,
    workers: Annotated[int | None, typer.Option(help="Worker processes to start here.")] = None,
    prepare: Annotated[
        bool, typer.Option("--prepare", help="Update the database and import the demo scenes first.")
    ] = False,
) -> None:
    """Start Snap6D and print a link to sign in with."""
    from app.listening import listen
    from app.snapping import create_snapper

    given = {
        "host": host,
        "port": port,
        "state_dir": state_dir,
        "database_url": database_url,
        "scheduler_address": scheduler_address,
        "workers": workers,
    }
    settings = read_settings(**given)
    listener = listen(settings)
    settings.state_dir.mkdir(parents=True, exist_ok=True)
    snapper = create_snapper(settings)
    try:
        from app import server  # its imports take seconds, in which the workers start

        server.run(settings, listener, snapper, prepare, console.print)
    finally:
        snapper.close()


@cli.command()
def migrate() -> None:
    """Make the database, or bring it up to this version."""
    database = open_database(read_settings())
    database.migrate()
    console.print("The database is up to date.")


@cli.command("import")
def import_command(
    path: Annotated[Path, typer.Argument(help="Folder of a BOP dataset.")],
    name: Annotated[str | None, typer.Option(help="Another name for the dataset.")] = None,
) -> None:
    """Import a BOP dataset; repeating it adds only what is new."""
    from app.importing import import_dataset
    from app.storage import FileStore

    settings = read_settings()
    database = checked_database(settings)
    with progress_bar() as progress:
        task = progress.add_task("checking", total=1.0)
        summary = import_dataset(
            database,
            FileStore(settings.files_dir),
            path,
            name,
            lambda share, what: progress.update(task, completed=share, description=what),
        )
    console.print(
        f"Dataset {summary.name}: {summary.objects} new objects, {summary.scenes} new scenes,"
        f" {summary.frames} new frames, {summary.tasks} new tasks."
    )


@cli.command("export")
def export_command(
    dataset: Annotated[str, typer.Argument(help="Name of the dataset.")],
    out: Annotated[Path, typer.Argument(help="Zip file to write.")],
) -> None:
    """Export the submitted poses of a dataset in BOP format, checked by reading them back."""
    from app.export.job import export_dataset
    from app.storage import FileStore

    settings = read_settings()
    database = checked_database(settings)
    dataset_id = _dataset_id(database, dataset)
    with progress_bar() as progress:
        task = progress.add_task("exporting", total=1.0)
        summary = export_dataset(
            database,
            FileStore(settings.files_dir),
            dataset_id,
            out,
            lambda share, what: progress.update(task, completed=share, description=what),
        )
    console.print(
        f"{out}: {summary.annotations} poses in {summary.images} images of {summary.scenes} scenes, read back"
        " and found right."
    )


@cli.command("calibrate")
def calibrate_command(
    dataset: Annotated[str, typer.Argument(help="Name of the dataset.")],
    reset: Annotated[bool, typer.Option("--reset", help="Go by the shipped calibration again.")] = False,
) -> None:
    """Calibrate the confidence by a dataset's own submitted registrations, and say what that gained."""
    from app.calibrating import calibrate, experience_of, forget, keep, told
    from app.scene_data import SceneData
    from app.standards import Standards
    from app.storage import FileStore

    settings = read_settings()
    database = checked_database(settings)
    dataset_id = _dataset_id(database, dataset)
    if reset:
        with database.write() as session:
            had_one = forget(session, dataset_id)
        console.print(
            f"Dataset {dataset} goes by the shipped calibration again."
            if had_one
            else f"Dataset {dataset} has no calibration of its own.",
            markup=False,
        )
        return
    known = experience_of(database, SceneData(FileStore(settings.files_dir)), dataset_id)
    row, gains = calibrate(known, Standards(database, settings.risk).of(dataset_id).risk)
    with database.write() as session:
        keep(session, dataset_id, row)
    for line in told(gains):
        console.print(line, markup=False)
    console.print(f"Snaps of dataset {dataset} go by this from now on; --reset takes it back.", markup=False)


@token_cli.command("create")
def create_token(name: str, role: RoleOption = "operator") -> None:
    """Print an API token for NAME, once."""
    from app.auth import Auth

    console.print(Auth(checked_database(read_settings())).create_token(name, _role(role)))


@user_cli.command("add")
def add_user(
    name: str,
    role: RoleOption = "operator",
    password: Annotated[bool, typer.Option("--password", help="Ask for a password now.")] = False,
) -> None:
    """Add a person, and print a one-time link to sign in with."""
    from app.auth import Auth
    from app.listening import sign_in_link

    settings = read_settings()
    auth = Auth(checked_database(settings))
    secret = typer.prompt("Password", hide_input=True, confirmation_prompt=True) if password else None
    user = auth.create_user(name, _role(role), secret)
    console.print(f"User {user.name} may sign in, once, with this link:")
    console.print(sign_in_link(settings, settings.port, auth.create_link(user.id)))


@user_cli.command("link")
def link_user(name: str) -> None:
    """Print a one-time link for a person who is there already."""
    from app.auth import Auth
    from app.listening import sign_in_link

    settings = read_settings()
    auth = Auth(checked_database(settings))
    link = sign_in_link(settings, settings.port, auth.create_link(auth.user(name).id))
    console.print(f"User {name} may sign in, once, with this link:")
    console.print(link)


def _dataset_id(database: "Database", name: str) -> int:
    """The id of a dataset by its name."""
    from sqlalchemy import select

    from app.tables import Dataset

    with database.read() as session:
        ids = {row.name: row.id for row in session.scalars(select(Dataset))}
    if name not in ids:
        fail(f"there is no dataset {name!r}; there are: {', '.join(ids) or 'none'}")
    return ids[name]


def _role(name: str):  # type: ignore[no-untyped-def] # Role is imported late
    from app.auth import Role

    given = [role for role in Role if role is not Role.PARTICIPANT]  # which only a study gives
    if name not in given:
        fail(f"role {name!r} is unknown; choose one of {', '.join(given)}")
    return Role(name)


if __name__ == "__main__":
    main()
