"""The pages: for whom, with which headers, and made of nothing but our own files."""

import re
from html.parser import HTMLParser
from urllib.parse import urlsplit

import httpx
import pytest

from app.pages import CONTENT_SECURITY_POLICY, TEMPLATES, html_of
from app.resources import STATIC
from tests.app.live import LiveServer
from tests.app.rest import begin, sentence

PAGES = sorted(path.stem for path in TEMPLATES.glob("*.html"))
SHARED = STATIC / "shared"
FILES = sorted(path for path in STATIC.rglob("*") if path.is_file())
SVG_NAMESPACE = "http://www.w3.org/2000/svg"
IMPORT = r"""^(?:import\s[^;"']*|export\s*[*{][^;"']*from\s*)["']([^"']+)["']"""


class Tags(HTMLParser):
    """All tags of a page with their attributes, and the text in its scripts and styles."""

    def __init__(self, content: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.ids: list[str] = []
        self.inline = ""
        self._in_code = False
        self.feed(content)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.ids += [value for name, value in attrs if name == "id" and value]
        self._in_code = tag in {"script", "style"}

    def handle_endtag(self, tag: str) -> None:
        self._in_code = False

    def handle_data(self, data: str) -> None:
        self.inline += data if self._in_code else ""


# -- who gets which page


@pytest.mark.parametrize(
    ("path", "wanted"),
    [
        ("/", "%2F"),
        ("/export", "%2Fexport"),
        ("/studies?study=3", "%2Fstudies%3Fstudy%3D3"),
        ("/label/7", "%2Flabel%2F7"),
        ("/label/7?frame=2&next=//evil.example", "%2Flabel%2F7%3Fframe%3D2%26next%3D%2F%2Fevil.example"),
    ],
)
def test_strangers_are_sent_to_sign_in_and_back(live: LiveServer, path: str, wanted: str) -> None:
    answer = live.stranger().get(path)
    assert answer.status_code == 303
    assert answer.headers["location"] == f"/sign-in?next={wanted}"


@pytest.mark.parametrize(
    ("path", "title"),
    [
        ("/", "Snap6D"),
        ("/export", "Export"),
        ("/studies", "Studies"),
        ("/participate", "Study"),
        ("/label/1", "Label"),
        ("/replay/1", "Replay"),
        ("/sign-in", "Sign in"),
    ],
)
def test_who_is_signed_in_gets_the_page(live: LiveServer, path: str, title: str) -> None:
    reader = live.person("a reader of pages")
    begin(reader)  # the first registration, to be replayed
    answer = reader.get(path)
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")
    found = re.search("<title>(.*)</title>", answer.text)
    assert found is not None and title in found[1]


def test_rest_can_be_read_by_all_like_its_description(live: LiveServer) -> None:
    for address in ("/api/docs", "/api/openapi.json", "/static/swagger/swagger-ui-bundle.js"):
        assert live.stranger().get(address).status_code == 200


def test_after_signing_out_the_pages_are_closed(live: LiveServer) -> None:
    person = live.person("somebody who leaves")
    person.post("/api/sign-out")
    assert person.get("/").status_code == 303


@pytest.mark.parametrize(
    "path",
    [
        "/label",
        "/label/",
        "/label/1/2",
        "/home.html",
        "/static/home.html",
        "/static/",
        "/static/..%2fpyproject.toml",
    ],
)
def test_there_is_no_other_page(live: LiveServer, path: str) -> None:
    sentence(live.person("a reader of pages").get(path), 404)


UNKNOWN = [
    "/nothing",
    "/label",
    "/label/abc",
    "/label/999999",
    "/label/99999999999999999999",
    "/label/\u0663",
    "/label/1/2",
    "/objects/999999",
    "/replay/999999",
    "/report/999999",
    "/report/nobody",
]


@pytest.mark.parametrize("path", UNKNOWN)
def test_an_unknown_page_says_so_and_leads_home(live: LiveServer, path: str) -> None:
    person = live.person("a reader of pages")
    answer = person.get(path, headers={"accept": "text/html,*/*;q=0.8"})
    assert answer.status_code == 404
    assert "There is no such page" in answer.text and 'href="/"' in answer.text
    assert answer.headers["content-security-policy"] == CONTENT_SECURITY_POLICY
    sentence(person.get(path), 404)  # to a program


@pytest.mark.parametrize("path", ["/api/nothing", "/static/nothing.js"])
def test_what_is_for_programs_answers_them_in_a_browser_too(live: LiveServer, path: str) -> None:
    sentence(live.person("a reader of pages").get(path, headers={"accept": "text/html"}), 404)


# -- headers


@pytest.mark.parametrize(
    "path", ["/", "/sign-in", "/export", "/label/1", "/api/docs", "/api/health", "/api/me", "/nothing"]
)
@pytest.mark.parametrize("signed_in", [False, True])
def test_pages_and_answers_keep_to_themselves(live: LiveServer, path: str, signed_in: bool) -> None:
    client = live.person("a reader of pages") if signed_in else live.stranger()
    headers = client.get(path).headers
    assert headers["content-security-policy"] == CONTENT_SECURITY_POLICY
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "same-origin"
    assert headers["cache-control"] == "no-store"


def test_the_policy_lets_only_our_own_files_in() -> None:
    policy = dict(directive.split(" ", 1) for directive in CONTENT_SECURITY_POLICY.split("; "))
    assert policy["default-src"] == policy["frame-ancestors"] == policy["form-action"] == "'self'"
    assert policy["base-uri"] == "'none'"
    assert "unsafe" not in CONTENT_SECURITY_POLICY and "*" not in CONTENT_SECURITY_POLICY
    assert "http" not in CONTENT_SECURITY_POLICY


def test_assets_are_asked_for_anew(live: LiveServer) -> None:
    answer = live.stranger().get("/static/style/tokens.css")
    assert answer.headers["content-type"].startswith("text/css")
    assert answer.headers["cache-control"] == "no-cache"
    assert answer.headers["x-content-type-options"] == "nosniff"
    again = live.stranger().get("/static/style/tokens.css", headers={"if-none-match": answer.headers["etag"]})
    assert again.status_code == 304


def test_the_view_may_stand_in_our_page_and_pictures_may_be_kept(live: LiveServer) -> None:
    person = live.person("a looker at views")
    registration = begin(person)
    view = person.get(registration["view_url"])
    assert "content-security-policy" not in view.headers  # it is viser's page, with scripts of its own
    assert "x-frame-options" not in view.headers
    task = person.get(f"/api/tasks/{registration['task_id']}").json()
    assert "max-age" in person.get(task["thumbnail_url"]).headers["cache-control"]


# -- what the pages are made of


def test_no_half_made_page_lies_among_the_files() -> None:
    assert [file for file in FILES if file.suffix == ".html"] == []
    assert not TEMPLATES.is_relative_to(STATIC)


@pytest.mark.parametrize("page", PAGES)
def test_a_page_stands_in_the_shell(page: str) -> None:
    tags = [tag for tag, _ in Tags(html_of(page)).tags]
    assert [tags.count(tag) for tag in ("html", "head", "title", "body", "main")] == [1] * 5
    assert html_of(page).startswith("<!doctype html>")


@pytest.mark.parametrize("page", PAGES)
def test_a_page_has_no_script_or_style_of_its_own(page: str) -> None:
    parsed = Tags(html_of(page))
    assert parsed.inline.strip() == ""
    assert "style" not in {tag for tag, _ in parsed.tags}
    for tag, attributes in parsed.tags:
        assert not [name for name in attributes if name.startswith("on") or name == "style"], (
            tag,
            attributes,
        )
        if tag == "script":
            assert attributes["type"] == "module" and (attributes["src"] or "").startswith("/static/")


@pytest.mark.parametrize("page", PAGES)
def test_all_that_a_page_names_is_there(live: LiveServer, page: str) -> None:
    parsed = Tags(html_of(page))
    assert len(parsed.ids) == len(set(parsed.ids))
    client: httpx.Client = live.person("a reader of pages")
    named = {
        address
        for _, attributes in parsed.tags
        for name, address in attributes.items()
        if name in ("src", "href") and address
    }
    for address in named:
        parts = urlsplit(address)
        assert not parts.netloc and not parts.scheme
        if parts.path:
            assert client.get(parts.path).status_code == 200, address
        if parts.fragment and parts.path.endswith(".svg"):
            assert f'id="{parts.fragment}"' in (STATIC / parts.path.removeprefix("/static/")).read_text()
    for tag, attributes in parsed.tags:
        for name in ("for", "aria-labelledby", "aria-describedby"):
            for target in (attributes.get(name) or "").split():
                assert target in parsed.ids, (tag, name, target)


@pytest.mark.parametrize("file", FILES + sorted(TEMPLATES.rglob("*.html")), ids=lambda file: file.name)
def test_no_file_names_another_host(file) -> None:
    content = file.read_text().replace(SVG_NAMESPACE, "")
    assert not re.findall(r"(?:https?|wss?):?//[^\s\"'`]*", content)
    assert not re.findall(r"""["'(`]//\w""", content)
    assert not re.findall(r"@import|@font-face", content)


@pytest.mark.parametrize("script", sorted(STATIC.rglob("*.js")), ids=lambda s: str(s.relative_to(STATIC)))
def test_a_script_imports_what_is_there_and_makes_no_code(script) -> None:
    content = script.read_text()
    for name in re.findall(IMPORT, content, re.MULTILINE):
        assert name.startswith("."), name
        imported = (script.parent / name).resolve()
        assert imported.is_file(), name
        assert SHARED not in script.parents or SHARED in imported.parents, "what pages share knows no page"
    assert not re.findall(r"\beval\(|new Function\(|\.innerHTML\s*=|document\.write", content)
