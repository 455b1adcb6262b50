"""Who is missing, when the drives brake, and when a team at rest times out waiting."""

import pytest

from coop_drake.answers.budget import Budget
from coop_drake.apart.membership import Membership, Processes
from coop_drake.apart.messages import SUPERVISOR
from coop_drake.apart.node import FOLLOWS, OUTSIDE, STANDS
from coop_drake.apart.processes import tolerated_age
from coop_drake.scenario import Deployment
from coop_drake.scenario.deployment import Measurements


class Book(Processes):
    """A membership, with who has ended, what was revived and what was told."""

    def __init__(self, *, restarts=0, rejoin=60.0, **options):
        self.ended, self.told, self.restarts = set(), [], restarts
        self.membership = Membership(rejoin=rejoin, **options, processes=self, tell=self.told.append)

    def gone(self):
        return self.ended

    def revive(self, index):
        if not self.restarts:
            return False
        self.restarts -= 1
        self.ended.discard(index)
        return True


def test_the_drives_brake_once_a_robot_is_missing_for_longer_than_is_tolerated():
    book = Book()
    book.membership.lose({1: 0.39})
    book.membership.see(0.40, {0: FOLLOWS}, rests=False)
    assert not book.membership.stopped
    book.membership.see(0.42, {0: FOLLOWS}, rests=False)
    assert book.membership.stopped
    assert book.told == ["robot 1 has not answered since t = 0.39 s"]
    book.membership.back(1)
    book.membership.see(0.9, {0: STANDS, 1: STANDS}, rests=True)
    book.membership.close_line(1.1, certified=True)
    assert book.membership.facts()["stops"] == [
        {"cause": "robot 1", "since": 0.42, "rested": 0.9, "resumed": 1.1, "certified": True}
    ]
    assert book.told[1:] == ["robot 1 is there again", "the team goes on at t = 1.1 s"]


def test_where_nothing_is_tolerated_the_drives_brake_at_the_first_sample_without_an_answer():
    book = Book(tolerated=0.0)
    assert not book.membership.too_long(0.3, 0.1 + 0.2)
    book.membership.lose({1: 0.395})
    book.membership.see(0.4, {0: FOLLOWS}, rests=False)
    assert book.membership.stopped


@pytest.mark.parametrize(("planned", "tolerated"), [(None, 0.02), (0.01, 0.0), (0.025, 0.015), (0.005, 0.0)])
def test_a_budget_tolerates_what_its_delay_leaves_beside_that_of_measurements(planned, tolerated):
    deployment = Deployment(control_rate=200.0, measurements=Measurements(delay=0.01))
    found = tolerated_age(deployment, None if planned is None else Budget(delay=planned))
    assert found == pytest.approx(tolerated)


def test_without_the_supervisor_the_drives_do_not_brake():
    book = Book()
    book.membership.lose({SUPERVISOR: 0.3})
    book.membership.see(5.0, {0: FOLLOWS, 1: FOLLOWS}, rests=True)
    assert not book.membership.stopped
    assert not book.membership.trouble


@pytest.mark.parametrize(("rejoin", "ended"), [(0.0, set()), (60.0, {1})])
def test_a_team_at_rest_waits_neither_for_ever_nor_for_who_does_not_come_back(rejoin, ended):
    book = Book(rejoin=rejoin)
    book.ended = ended
    book.membership.lose({1: 0.39})
    book.membership.see(0.5, {}, rests=False)
    assert not book.membership.trouble
    book.membership.see(1.0, {}, rests=True)
    assert book.told[-1] == f"the team rests and waits for robot 1 for at most {rejoin:g} s"
    assert (
        book.membership.trouble == "robot 1 has not answered since t = 0.39 s; the team rests since t = 1 s"
    )


def test_who_has_ended_is_started_again_as_often_as_allowed():
    book = Book(restarts=2)
    book.ended = {1}
    book.membership.lose({1: 0.39})
    assert book.told == ["robot 1 has not answered since t = 0.39 s; it is started again"]
    for time, trouble in ((1.0, False), (1.1, True)):
        book.ended = {1}
        book.membership.see(time, {}, rests=True)
        assert bool(book.membership.trouble) == trouble
    assert book.membership.facts()["restarts"] == {"robot 1": 2}


def test_a_team_that_rests_outside_its_cell_ends_the_run():
    book = Book()
    book.membership.see(0.4, {0: STANDS, 1: STANDS}, rests=False)
    for time, trouble in ((0.8, ""), (1.2, ""), (1.4, "robot 1 cannot begin")):
        book.membership.see(time, {0: STANDS, 1: OUTSIDE}, rests=True)
        assert book.membership.trouble.startswith(trouble)
        assert bool(book.membership.trouble) == bool(trouble)
    assert book.membership.trouble.endswith("the team rests since t = 0.8 s")
