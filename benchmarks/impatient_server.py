"""The real `snap6d`, but one that closes idle sessions after seconds and not after half an hour."""

IDLE_SECONDS = 5.0
SECONDS_BETWEEN_CLEANINGS = 1.0


def main() -> None:
    """Run the command line with shorter periods."""
    import app.main
    from app.cli import commands as cli
    from app.labeling.live.sessions import LiveSessions

    app.main.SECONDS_BETWEEN_CLEANINGS = SECONDS_BETWEEN_CLEANINGS
    LiveSessions.close_idle.__defaults__ = (IDLE_SECONDS,)
    cli.main()


if __name__ == "__main__":  # worker processes import this module too
    main()
