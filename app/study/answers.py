"""What the participants of a study answered, as a table."""

import csv
import io

from sqlalchemy import select

from app.storage.database import Database
from app.storage.tables import Participant
from app.study.plan import DECLINED

COLUMNS = ("code", "group", "is_simulated", "question", "answer", "status")
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")
"""A spreadsheet runs a cell that begins so, whoever wrote it (OWASP: CSV injection)."""


def answers_csv(database: Database, study_id: int) -> bytes:
    """A row for each answer of each participant who did not withdraw, as CSV, UTF-8, with a header.

    `status` tells what was left empty from what somebody declined to say. Whoever has not come to the
    questions yet has no rows. A free answer that a spreadsheet would run begins with an apostrophe.
    """
    query = select(Participant).where(Participant.study_id == study_id, Participant.withdrawn_at.is_(None))
    with database.read() as session:
        participants = session.scalars(query.order_by(Participant.id)).all()
    sink = io.StringIO()
    table = csv.writer(sink, lineterminator="\n")
    table.writerow(COLUMNS)
    for one in participants:
        for question, answer in (one.answers or {}).items():
            row = (one.code, one.group, one.is_simulated, question, answer or "", _status(answer))
            table.writerow([_harmless(str(cell)) for cell in row])
    return sink.getvalue().encode()


def _status(answer: str | None) -> str:
    if answer is None:
        return "left empty"
    return "declined" if answer == DECLINED else "answered"


def _harmless(cell: str) -> str:
    return f"'{cell}" if cell.startswith(FORMULA_STARTS) else cell
