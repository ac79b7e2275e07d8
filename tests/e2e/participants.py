"""People who take part in a study."""

from secrets import token_hex

from playwright.sync_api import Page

from tests.processes import Server


def participant_link(admin: Page, server: Server) -> str:
    """Of a new study of one thing, quickly and by hand alone; there is no consent and no practice."""
    task = admin.request.get(f"{server.url}/api/tasks").json()["items"][0]
    thing = {"scene_id": task["scene"]["id"], "object_id": task["object"]["id"]}
    plan = {"tasks": [thing], "modes": ["quick"], "groups": {"novice": 1}}
    studies = f"{server.url}/api/studies"
    study = admin.request.post(studies, data={"name": f"Trouble {token_hex(3)}", "plan": plan}).json()
    invited = admin.request.post(f"{studies}/{study['id']}/participants", data={"group": "novice"})
    return str(invited.json()["link"])
