"""E10, E15a and E15b: how far the governor may lead, and when the next cell may take over."""

import numpy as np
import pytest

from coop_drake.laws import energy_margin, tracking_energy
from coop_drake.laws.readiness import clearance_margin
from paper import printed
from paper.governor_run import box_clearance, run_governor, straight_field

TABLE_2 = (50.0, 5.0, 5.0, 0.0)
ROOM = box_clearance(np.array([0.0, -1.0]), np.array([4.0, 1.0]))


def start_at(point):
    return {"position": np.array(point), "velocity": np.zeros(2), "governor": np.array(point)}


def test_e15a_twice_the_wrong_energy_goes_through_the_wall():
    """A target 2 cm from a wall: K d allows the spring more energy than it can store before the wall."""
    run = {
        margin: run_governor(
            ROOM,
            straight_field(np.array([3.98, 0.0])),
            gains=TABLE_2,
            seconds=6.0,
            margin=margin,
            **start_at([2.0, 0.0]),
        )
        for margin in (printed.energy_margin, energy_margin)
    }
    as_printed, corrected = run[printed.energy_margin], run[energy_margin]
    assert as_printed.margin.min() > 0.9
    assert min(ROOM(p) for p in as_printed.position) < -0.02
    assert corrected.margin.min() > 0.0
    assert min(ROOM(p) for p in corrected.position) > 0.0
    assert corrected.position[-1] == pytest.approx([3.98, 0.0], abs=1e-3)


def test_e15b_a_wall_around_the_goal_keeps_the_object_out():
    """F has the goal's boundary in its own; the distance to that vanishes on the way in."""
    target, radius = np.array([3.0, 0.0]), 0.3

    def to_boundary_of_f(point):
        return min(ROOM(point), abs(float(np.hypot(*(point - target))) - radius))

    def distances(clearance):
        run = run_governor(
            clearance, straight_field(target), gains=TABLE_2, seconds=30.0, **start_at([1.0, 0.2])
        )
        return np.hypot(*(run.position - target).T)

    assert distances(to_boundary_of_f).min() > radius
    assert distances(ROOM)[-1] < 1e-3


class TestE10:
    """A narrow cell across the way of a fast object: being in it is not enough to take over."""

    narrow = staticmethod(box_clearance(np.array([2.0, -1.0]), np.array([2.3, 1.0])))
    target = np.array([2.15, 0.0])

    def approach(self):
        return run_governor(
            ROOM, straight_field(self.target), gains=TABLE_2, seconds=12.0, **start_at([0.5, 0.0])
        )

    def take_over(self, run, index):
        return run_governor(
            self.narrow,
            straight_field(self.target),
            position=run.position[index],
            velocity=run.velocity[index],
            governor=run.governor[index],
            gains=TABLE_2,
            seconds=6.0,
        )

    def margins(self, run):
        stiffness = TABLE_2[0]
        return np.array(
            [
                energy_margin(tracking_energy(*(p - g), *v, stiffness), self.narrow(g), stiffness)
                for p, v, g in zip(run.position, run.velocity, run.governor, strict=True)
            ]
        )

    def test_as_printed_the_next_cell_begins_with_too_much_energy_and_is_left(self):
        run = self.approach()
        first_inside = next(i for i, p in enumerate(run.position) if self.narrow(p) > 0.0)
        assert self.margins(run)[first_inside] < 0.0
        taken_over = self.take_over(run, first_inside)
        assert min(self.narrow(p) for p in taken_over.position) < 0.0

    def test_as_corrected_it_begins_when_it_can_be_kept(self):
        run, inradius = self.approach(), 0.15
        ready = [clearance_margin(m, TABLE_2[0], inradius) >= 0.0 for m in self.margins(run)]
        first_ready = ready.index(True)
        assert self.narrow(run.position[first_ready]) > 0.0
        taken_over = self.take_over(run, first_ready)
        assert taken_over.margin.min() >= 0.0
        assert min(self.narrow(p) for p in taken_over.position) > 0.0
        assert taken_over.position[-1] == pytest.approx(self.target, abs=1e-3)
