"""The command line. Heavy imports stay inside the commands: worker processes import this module too."""

import os
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from app.cli.study import study_cli
from app.cli.terminal import checked_database, console, fail, open_database, progress, read_settings
from app.export.formats.registry import formats

if TYPE_CHECKING:
    from app.config import Settings
    from app.storage.database import Database

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
        from app.storage.faults import told

        fail(told(error))


@cli.command()
def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on; 0 takes a free one.")] = None,
    state_dir: Annotated[Path | None, typer.Option(help="Database, files and exports.")] = None,
    database_url: Annotated[str | None, typer.Option(help="Another database, such as PostgreSQL.")] = None,
    scheduler_address: Annotated[str | None, typer.Option(help="A Dask scheduler to use.")] = None,
    workers: Annotated[int | None, typer.Option(help="Worker processes to start here.")] = None,
    prepare: Annotated[bool, typer.Option("--prepare", help="Update an older database first.")] = False,
) -> None:
    """Start Snap6D and print a link to sign in with."""
    from app.serving.listening import listen
    from app.serving.state_lock import held

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
    with held(settings.state_dir, settings.host, listener.getsockname()[1]):
        with closing(open_database(settings)) as database:
            prepare = prepare or database.is_new()
            if not prepare:
                database.check_version()  # or it would be said when all else has started
        from app.workers.pool import create_snapper

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


@cli.command("check")
def check_command() -> None:
    """Examine the database and all stored files, and say what is wrong and what to do."""
    from app.storage.checkup import examine
    from app.storage.named_files import open_store

    settings = read_settings()
    database = open_database(settings)
    with progress("checking") as on_progress:
        found = examine(
            database,
            open_store(settings.files_dir, database),
            on_progress,
        )
    for fault in found.faults:
        console.print(fault)
    if found.unnamed:
        console.print(
            f"{found.unnamed} files ({found.unnamed_bytes / 1e6:.1f} MB) in {settings.files_dir} are named by"
            " no row; they are left from interrupted imports and do no harm."
        )
    if found.faults:
        fail(f"{len(found.faults)} faults were found; they are listed above")
    console.print(f"The database and its {found.files} files are sound.")


@cli.command("backup")
def backup_command(file: Annotated[Path, typer.Argument(help="Archive to write; ends in .tar.")]) -> None:
    """Write the database and all stored files into one archive, also while a server runs."""
    from app.storage.backup import back_up
    from app.storage.named_files import open_store

    if file.suffix != ".tar":
        fail(f"{file} does not end in .tar; a backup is a tar archive")
    settings = read_settings()
    database = checked_database(settings)
    with progress("backing up") as on_progress:
        done = back_up(
            database,
            open_store(settings.files_dir, database),
            file,
            on_progress,
        )
    for fault in done.faults:
        console.print(fault)
    if done.faults:
        fail(f"{file} was written without {len(done.faults)} files that are damaged; they are listed above")
    console.print(f"{file}: the database and {done.files} files.")


@cli.command("import")
def import_command(
    path: Annotated[Path, typer.Argument(help="Folder of a BOP dataset.")],
    name: Annotated[str | None, typer.Option(help="Another name for the dataset.")] = None,
    depth_scale: Annotated[
        float | None,
        typer.Option(help="In the place of the dataset's own: raw depth times it is millimetres."),
    ] = None,
) -> None:
    """Import a BOP dataset; repeating it adds only what is new."""
    from app.datasets.importing import import_dataset
    from app.storage.files import FileStore

    settings = read_settings()
    database = checked_database(settings)
    with progress("checking") as on_progress:
        summary = import_dataset(
            database,
            FileStore(settings.files_dir),
            path,
            name,
            on_progress,
            depth_scale,
        )
    for warning in summary.warnings:
        where = f" ({'; '.join(warning.images)})" if warning.images else ""
        console.print(f"Odd: {warning.text}{where}.")
    console.print(
        f"Dataset {summary.name}: {summary.objects} new objects, {summary.scenes} new scenes,"
        f" {summary.frames} new frames, {summary.tasks} new tasks."
    )


def _known_format(name: str) -> str:
    if name not in formats():
        raise typer.BadParameter(f"{name!r} is not one of {', '.join(formats())}")
    return name


@cli.command("export")
def export_command(
    dataset: Annotated[str, typer.Argument(help="Name of the dataset.")],
    out: Annotated[Path, typer.Argument(help="Zip file to write.")],
    format_name: Annotated[
        str,
        typer.Option(
            "--format",
            help="A whole BOP dataset, or its poses alone.",
            metavar=f"[{'|'.join(formats())}]",
            callback=_known_format,
        ),
    ] = "bop",
) -> None:
    """Export the submitted poses of a dataset, checked by reading them back."""
    from app.export.job import export_dataset
    from app.storage.named_files import open_store

    settings = read_settings()
    database = checked_database(settings)
    dataset_id = _dataset_id(database, dataset)
    with progress("exporting") as on_progress:
        summary = export_dataset(
            database,
            open_store(settings.files_dir, database),
            dataset_id,
            out,
            on_progress,
            format_name,
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
    from app.confidence.calibrating import calibrate, experience_of, forget, keep, told
    from app.confidence.standards import Standards
    from app.datasets.scene_data import SceneData
    from app.storage.named_files import open_store

    settings = read_settings()
    database = checked_database(settings)
    dataset_id = _dataset_id(database, dataset)
    if reset:
        with database.write() as session:
            had_one = forget(session, dataset_id)
        console.print(
            f"Dataset {dataset} goes by the shipped calibration again."
            if had_one
            else f"Dataset {dataset} has no calibration of its own."
        )
        return
    known = experience_of(database, SceneData(open_store(settings.files_dir, database)), dataset_id)
    row, gains = calibrate(known, Standards(database, settings.risk).of(dataset_id).risk)
    with database.write() as session:
        keep(session, dataset_id, row)
    for line in told(gains):
        console.print(line)
    console.print(f"Snaps of dataset {dataset} go by this from now on; --reset takes it back.")


@token_cli.command("create")
def create_token(name: str, role: RoleOption = "operator") -> None:
    """Print an API token for NAME, once."""
    from app.access.auth import Auth

    console.print(Auth(checked_database(read_settings())).create_token(name, _role(role)))


@user_cli.command("add")
def add_user(
    name: str,
    role: RoleOption = "operator",
    password: Annotated[bool, typer.Option("--password", help="Ask for a password now.")] = False,
) -> None:
    """Add a person, and print a one-time link to sign in with."""
    from app.access.auth import Auth

    settings = read_settings()
    auth = Auth(checked_database(settings))
    secret = typer.prompt("Password", hide_input=True, confirmation_prompt=True) if password else None
    user = auth.create_user(name, _role(role), secret)
    console.print(f"User {user.name} may sign in, once, with this link:")
    console.print(_link(settings, auth.create_link(user.id)))


@user_cli.command("link")
def link_user(name: str) -> None:
    """Print a one-time link for a person who is there already."""
    from app.access.auth import Auth

    settings = read_settings()
    auth = Auth(checked_database(settings))
    link = _link(settings, auth.create_link(auth.user(name).id))
    console.print(f"User {name} may sign in, once, with this link:")
    console.print(link)


def _link(settings: "Settings", secret: str) -> str:
    """A sign-in link to where the server of the state folder listens, or would by the settings."""
    from app.serving.listening import sign_in_link
    from app.serving.state_lock import running_server

    running = running_server(settings.state_dir)
    if running is not None:
        settings = settings.model_copy(update={"host": running.host, "port": running.port})
    return sign_in_link(settings, settings.port, secret)


def _dataset_id(database: "Database", name: str) -> int:
    """The id of a dataset by its name."""
    from sqlalchemy import select

    from app.storage.tables import Dataset

    with database.read() as session:
        ids = {row.name: row.id for row in session.scalars(select(Dataset))}
    if name not in ids:
        fail(f"there is no dataset {name!r}; there are: {', '.join(ids) or 'none'}")
    return ids[name]


def _role(name: str):  # type: ignore[no-untyped-def] # Role is imported late
    from app.storage.roles import Role

    given = [role for role in Role if role is not Role.PARTICIPANT]  # which only a study gives
    if name not in given:
        fail(f"role {name!r} is unknown; choose one of {', '.join(given)}")
    return Role(name)


if __name__ == "__main__":
    main()
