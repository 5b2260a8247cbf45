"""Rollouts (journey J9): beside, in some homes, halted by themselves, and taken back without an edit of anybody's being lost."""

from dataclasses import replace
from typing import Any

import pytest
import sqlalchemy as sa

from stillroom import __version__
from stillroom.service.fleet import judging, variants
from stillroom.service.fleet.judging import judge
from stillroom.service.fleet.shadowing import run_next_beside
from stillroom.service.fleet.variants import is_candidate, variant_for
from stillroom.store import rollouts
from stillroom.store.fleet_tables import rollout
from tests.conftest import RobotCaller, Service, features
from tests.fleets import Arms, put_at
from tests.homes import changed, home

ROLLOUTS = "/api/v1/fleet/rollouts"
GATE = {"measure": "meta_dividers", "margin": 0.01, "minimum_n": 300}
BARE: dict[str, Any] = {"name": "bare", "resolvers": [], "gates": [GATE]}


def start(service: Service, **changed: Any) -> Any:
    answer = service.operator.request("POST", ROLLOUTS, json=BARE | changed)
    assert answer.status_code == 201, answer.text
    return answer.json()


def post(service: Service, path: str, status: int = 200, **body: Any) -> Any:
    answer = service.operator.request("POST", f"{ROLLOUTS}/{path}", json=body or None)
    assert answer.status_code == status, answer.text
    return answer.json()


def show(service: Service, name: str = "bare") -> Any:
    answer = service.operator.get(f"{ROLLOUTS}/{name}")
    assert answer.status_code == 200, answer.text
    return answer.json()


def in_arm(candidate: bool, stage: int = 25, name: str = "bare") -> str:
    return next(f"RB-{n}" for n in range(1000) if is_candidate(name, stage, f"RB-{n}") is candidate)


TRACKING = {"transform": [0.0, 0.0, 0.0]}


def gap(robot: RobotCaller, key: str) -> Any:
    """A mission that the meta layer alone brings through."""
    base = robot.get(robot.path()).json()["version"]
    return robot.upload(key, changed("open plan"), base_version=base, tracking=TRACKING).json()


# -- which homes ---------------------------------------------------------------------------------------------------


def test_homes_stay_where_they_are_while_the_share_grows_and_another_rollout_has_others_first() -> None:
    homes = [f"RB-{n}" for n in range(20_000)]
    reached = {
        per_cent: {home for home in homes if is_candidate("a", per_cent, home)} for per_cent in (0, 1, 5, 25, 100)
    }
    assert reached[0] == set()
    assert reached[1] < reached[5] < reached[25] < reached[100] == set(homes)
    for per_cent in (1, 5, 25):
        assert len(reached[per_cent]) == pytest.approx(len(homes) * per_cent / 100, rel=0.15)
    others = {home for home in homes if is_candidate("b", 25, home)}
    assert len(others & reached[25]) == pytest.approx(len(homes) / 16, rel=0.15)


def test_what_was_successful_is_in_force_until_it_is_withdrawn_and_the_newest_counts(service: Service) -> None:
    def algorithm() -> tuple[str, tuple[str, ...]]:
        with service.database.read() as tx:
            found = variant_for(tx, "RB-1", ("meta_occupancy",))
        return found.algorithm, tuple(found.resolvers)

    assert algorithm() == (__version__, ("meta_occupancy",))
    for name in ("first", "second"):
        start(service, name=name)
        assert algorithm()[0] != f"{__version__}+{name}"  # beside
        with service.database.write() as tx:
            running = rollouts.running(tx)
            assert running is not None
            judging.end(tx, running, "successful", None, "It passed.")
        assert algorithm() == (f"{__version__}+{name}", ())
    assert [(row["name"], row["in_force"]) for row in service.operator.get(ROLLOUTS).json()["items"]] == [
        ("second", True), ("first", False),
    ]  # fmt: skip
    assert post(service, "second/end", reason="It was not worth it.")["withdrawn_at"] is not None
    assert algorithm()[0] == f"{__version__}+first"
    post(service, "second/end", 409, reason="It was not worth it.")


@pytest.mark.parametrize("engine", ["sqlite"])
def test_new_code_ends_a_rollout_of_the_old_and_leaves_alone_what_it_can_not_be_run_with(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    start(service)
    put_at(service.database, 100)
    monkeypatch.setattr(variants, "__version__", "9.9")
    monkeypatch.setattr(judging, "__version__", "9.9")
    with service.database.read() as tx:
        assert variant_for(tx, "RB-1", ()).part is None
    judge(service.database)
    assert (show(service)["state"], show(service)["ended_by"]) == ("inconclusive", None)
    with service.database.write() as tx:
        tx.execute(sa.update(rollout).values(state="successful", params={"a_parameter_of_old": 1}))
    with service.database.read() as tx:
        assert variant_for(tx, "RB-1", ()).algorithm == "9.9"


# -- beside --------------------------------------------------------------------------------------------------------


def test_beside_the_setting_in_force_no_map_changes_and_a_paired_table_appears(
    service: Service, mapped: RobotCaller
) -> None:
    assert start(service)["stage"] == 0
    mapped.upload("1", home(shift=(1, 0)))
    assert gap(mapped, "2")["outcome"] == "resolved"
    mapped.upload("1", home(shift=(1, 0)))  # again
    service.add_robot("RB-2").upload("0")  # carries nothing over
    before = mapped.get(mapped.path()).json()
    assert show(service)["beside"] == {"done": 0, "waiting": 2, "errors": 0}
    while run_next_beside(service.database, service.grids):
        pass
    found = show(service)
    assert mapped.get(mapped.path()).json() == before
    assert found["beside"] == {"done": 2, "waiting": 0, "errors": 0}
    cells = {
        table["measure"]: [table[c] for c in ("both", "only_old", "only_new", "neither")] for table in found["tables"]
    }
    assert cells["transfer"] == [1, 0, 0, 1]
    assert cells["meta_dividers"] == [1, 1, 0, 0]
    (gate,) = found["report"]
    assert (gate["verdict"], gate["old"]["count"], gate["new"]["count"], gate["new"]["missions"]) == (
        "waiting",
        0,
        1,
        2,
    )
    refused = post(service, "bare/advance", 409)
    assert refused["type"].endswith("gate-not-passed")
    assert "300" in refused["detail"]
    ended = post(service, "bare/end", reason="Not now.")
    assert (ended["state"], ended["ended_by"], ended["reason"]) == ("inconclusive", "operator", "Not now.")


@pytest.mark.parametrize("engine", ["sqlite"])
def test_what_the_candidate_can_not_process_counts_against_it(
    service: Service, mapped: RobotCaller, monkeypatch: pytest.MonkeyPatch
) -> None:
    start(service)
    mapped.upload("1", home(shift=(1, 0)))

    def broken(*_asked: Any, **_more: Any) -> Any:
        raise RuntimeError("worse than before")

    monkeypatch.setattr("stillroom.service.gathering.update_map", broken)
    assert run_next_beside(service.database, service.grids)
    assert not run_next_beside(service.database, service.grids)
    found = show(service)
    assert (found["beside"]["errors"], found["report"][0]["new"]["count"]) == (1, 1)


# -- judged by homes -----------------------------------------------------------------------------------------------


@pytest.fixture
def fleet(service: Service) -> Arms:
    start(service)
    return Arms(service.database)


@pytest.mark.parametrize("engine", ["sqlite"])
def test_seven_failures_against_four_of_300_are_inconclusive_and_it_does_not_go_on(
    service: Service, fleet: Arms
) -> None:
    fleet.add(1, False, 300, 4)
    fleet.add(1, True, 299, 7)
    assert show(service)["looks"] == []  # one mission too few
    fleet.add(1, True, 1, 0)
    found = show(service)
    (gate,), (look,) = found["report"], found["looks"]
    assert (found["verdict"], gate["verdict"], look["missions"], found["next_look"]) == ("inconclusive",) * 2 + (
        300,
        600,
    )
    assert [round(end, 3) for end in gate["old"]["ci95"]] == [0.005, 0.034]
    assert [round(end, 3) for end in gate["new"]["ci95"]] == [0.011, 0.047]
    assert gate["p"] == pytest.approx(0.55, abs=0.01)
    assert gate["more"] is None  # seven against four is just the margin
    assert post(service, "bare/advance", 409)["verdict"] == "inconclusive"
    assert show(service)["looks"] == found["looks"]  # however often it is asked, until there are twice as many
    assert (found["state"], found["stage"]) == ("running", 1)


def test_what_harms_halts_by_itself_and_those_who_run_the_service_are_told(service: Service, fleet: Arms) -> None:
    hook = {"url": "https://hooks.example.org/x", "scope": "fleet", "types": ["rollout.halted"]}
    made = service.operator.request("POST", "/api/v1/webhooks", json=hook)
    assert made.status_code == 201, made.text
    fleet.add(25, False, 400, 8)
    fleet.add(25, True, 300, 40)
    found = show(service)
    assert (found["state"], found["stage"], found["ended_by"]) == ("failed", 25, None)
    assert "13.3 % instead of 2.0 %" in found["reason"]
    with service.database.read() as tx:
        assert variant_for(tx, in_arm(True), ()).algorithm == __version__
    (sent,) = service.operator.get(f"/api/v1/webhooks/{made.json()['id']}/deliveries").json()["items"]
    assert (sent["type"], sent["body"]["data"]["rollout"], sent["body"]["data"]["stage"]) == (
        "rollout.halted",
        "bare",
        25,
    )
    post(service, "bare/advance", 409)
    start(service, name="next")


def test_what_passes_everywhere_is_successful_and_in_force(service: Service) -> None:
    start(service, gates=[GATE | {"margin": 0.03}])
    fleet = Arms(service.database)
    fleet.add(0, False, 400, 40, beside_failed=38)
    assert show(service)["verdict"] == "passed"
    assert post(service, "bare/advance")["stage"] == 1
    assert show(service)["verdict"] == "waiting"
    with service.database.write() as tx:
        tx.execute(sa.update(rollout).values(automatic=True))
    for stage in (1, 5, 25):
        fleet.add(stage, False, 400, 1)
        fleet.add(stage, True, 400, 1)
        assert show(service)["stage"] > stage
    fleet.add(100, True, 400, 1)
    found = show(service)
    assert (found["state"], found["in_force"], len(found["looks"])) == ("successful", True, 5)


@pytest.mark.parametrize("engine", ["sqlite"])
def test_missions_of_one_home_do_not_count_as_those_of_many(service: Service, fleet: Arms) -> None:
    """38 of 304 that failed would halt it; of eight homes, one of which always fails, they say little."""
    fleet.add(25, False, 300, 6)
    fleet.add(25, True, 304, 1, homes=8)
    found = show(service)
    assert (found["verdict"], found["state"], found["report"][0]["new"]["count"]) == ("inconclusive", "running", 38)


# -- taken back ----------------------------------------------------------------------------------------------------


def names(document: Any) -> set[str]:
    return {room["properties"]["name"] for room in features(document, "room")}


def test_maps_go_back_to_the_last_version_before_with_every_edit_of_their_owners(service: Service) -> None:
    old, new = (service.add_robot(in_arm(candidate)) for candidate in (False, True))
    for robot in (old, new):
        robot.upload("0")
    start(service, resolvers=["meta_occupancy", "meta_dividers"], params={"room_overlap": 0.45})
    put_at(service.database, 25)
    for robot in (old, new):
        assert robot.upload("1", home(shift=(1, 0))).json()["outcome"] == "updated"
        first = min(room["id"] for room in features(robot.get(robot.path()).json(), "room"))
        edit = service.operator.edit(robot.path(), 2, {"op": "rename_room", "id": first, "name": "Kitchen"})
        assert edit.status_code == 200, edit.text
        zone: Any = {"op": "add_restriction", "kind": "no_go", "shape": [[0.3, 0.3], [0.7, 0.3], [0.7, 0.7]]}
        assert service.operator.edit(robot.path(), 3, zone).status_code == 200
        assert robot.upload("2", changed("annex")).json()["outcome"] == "updated"
    rates = service.operator.get("/api/v1/fleet/failure-rates?group_by=algorithm").json()["items"]
    assert {row["key"]: row["missions"] for row in rates} == {__version__: 2, f"{__version__}+bare": 2}
    (listed,) = service.operator.get(f"{ROLLOUTS}/bare/maps").json()["items"]
    assert listed == {
        "robot": new.id, "map": "ground", "version": 5, "first": 2, "back_to": 1, "state": "to_revert",
    }  # fmt: skip
    post(service, "bare/revert", 409)
    post(service, "bare/end", reason="Rooms are lost.")
    before = old.get(old.path()).json()
    (done,) = post(service, "bare/revert")["reverted"]
    assert done == {"robot": new.id, "map": "ground", "version": 6, "back_to": 1, "kept": 2}
    document = new.get(new.path()).json()
    assert (document["version"], document["cause"]) == (6, "rollback")
    assert "Kitchen" in names(document)
    assert len(features(document, "room")) == 2  # the annex was found by the candidate
    (zone,) = features(document, "restriction")
    corners = [tuple(round(x, 2) for x in point) for point in zone["geometry"]["coordinates"][0][:3]]
    assert sorted(corners) == sorted(
        [(0.25, 0.3), (0.65, 0.3), (0.65, 0.7)]
    )  # a cell further left: that mission is gone
    assert old.get(old.path()).json() == before
    assert post(service, "bare/revert") == {"reverted": [], "kept": [], "next": None}
    assert service.operator.get(f"{ROLLOUTS}/bare/maps").json()["items"][0]["state"] == "undone"
    again = new.upload(
        "3", home(shift=(1, 0)), base_version=5, tracking=TRACKING
    )  # it left with what the candidate made
    assert again.json()["outcome"] == "updated"
    assert "Kitchen" in names(new.get(new.path()).json())
    assert (
        service.operator.get("/api/v1/fleet/failure-rates").json()["total"]["escapes"] == 0
    )  # nobody corrected anything


def test_what_an_owner_has_undone_or_agreed_to_is_left_alone(service: Service) -> None:
    new = service.add_robot(in_arm(True))
    new.upload("0")
    start(service, resolvers=["meta_occupancy", "meta_dividers"])
    put_at(service.database, 25)
    met = new.upload("1", changed("annex")).json()
    assert service.operator.request("POST", f"{new.path()}/versions/1/restore").status_code == 201
    post(service, "bare/end", reason="Rooms are lost.")
    assert service.operator.get(f"{ROLLOUTS}/bare/maps").json()["items"][0]["state"] == "undone"
    assert service.operator.request("POST", f"{new.path()}/versions/2/restore").status_code == 201
    assert service.operator.get(f"{ROLLOUTS}/bare/maps").json()["items"][0]["state"] == "to_revert"
    (conflict,) = met["conflicts"]
    agreed = service.operator.request(
        "POST", f"{new.path()}/conflicts/{conflict}/decision", json={"response": "accept"}
    )
    assert agreed.status_code == 200, agreed.text
    assert service.operator.get(f"{ROLLOUTS}/bare/maps").json()["items"][0]["state"] == "decided"
    assert post(service, "bare/revert") == {"reverted": [], "kept": [], "next": None}


# -- what is asked for ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ["sqlite"])
@pytest.mark.parametrize(
    "wrong",
    [
        {"name": "Has Spaces"},
        {"gates": []},
        {"gates": [GATE, GATE]},
        {"gates": [GATE | {"margin": 0}]},
        {"gates": [GATE | {"measure": "luck"}]},
        {"gates": [GATE | {"minimum_n": 5}]},
        {"params": {"no_such": 1}},
        {"resolvers": ["magic"]},
        {"more": 1},
    ],
)
def test_a_rollout_that_makes_no_sense_is_refused(service: Service, wrong: dict[str, Any]) -> None:
    answer = service.operator.request("POST", ROLLOUTS, json=BARE | wrong)
    assert answer.status_code == 422, answer.text
    assert answer.json()["errors"]


def test_there_is_one_rollout_at_a_time_and_a_name_is_used_once(service: Service, robot: RobotCaller) -> None:
    start(service)
    assert service.operator.request("POST", ROLLOUTS, json=BARE | {"name": "other"}).status_code == 409
    post(service, "bare/end", reason="Not now.")
    assert service.operator.request("POST", ROLLOUTS, json=BARE).status_code == 409
    for method, path in (
        ("POST", ""),
        ("GET", ""),
        ("GET", "/bare"),
        ("POST", "/bare/advance"),
        ("POST", "/bare/revert"),
    ):
        assert robot.request(method, f"{ROLLOUTS}{path}", json={}).status_code == 403
    for path in ("none", "none/maps"):
        assert service.operator.get(f"{ROLLOUTS}/{path}").status_code == 404


def test_the_label_of_a_rollout_fits_where_missions_are_counted() -> None:
    assert len(variants.label("a" * 20)) <= 32
    assert replace(variants.Variant("1", ()), algorithm="2").algorithm == "2"
