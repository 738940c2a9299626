"""Contact and control: values and derivatives against closed forms, and against the same steps at 60 digits."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import pytest
from exact_dynamics import held, stepped, thrown, warmed
from worlds_references import agrees, dual, program, reference

import potto

WALL = program("dynamics/ball_and_wall")
THROW = program("dynamics/three_impacts")
SPRING = program("dynamics/spring_and_stop")
CART = program("dynamics/parking")
POLE = program("dynamics/balancing")
ROOM = program("dynamics/room")


@pytest.mark.parametrize("wall", [0.1, 1.5, 1.999, 2.5])
def test_the_ball_comes_back_from_the_wall(wall: float) -> None:
    def exact(w: Any) -> Any:
        return w - (2 - w) / 2 if w < 2 else mp.mpf(2)

    agrees(dual(WALL, r"\w . place(2, w, 0.5)", wall), reference(exact, wall), 1e-14)


def test_the_wall_is_found() -> None:
    found = potto.fit(WALL.place, {"wall": 1.9}, given={"v": 2, "e": 0.5}, target=0.75)
    assert found.converged and abs(found["wall"] - 7 / 6) < 1e-6


@pytest.mark.parametrize("speed", [1.5, 4.0, 5.0, 7.0, 12.0])  # three impacts, two, one, none
@pytest.mark.parametrize("part", [0, 1])
def test_thrown_through_the_impacts(speed: float, part: int) -> None:
    found = dual(THROW, rf"\v . landing(2, v, 2.2).{part}", speed)
    agrees(found, reference(lambda v: thrown(mp.mpf(2), v, mp.mpf(2.2))[part], speed), 1e-12)


def test_a_throw_through_three_impacts_is_found() -> None:
    x, y = thrown(mp.mpf(1.7), mp.mpf(4.1), mp.mpf(2.2))
    start, target = {"u": 1.6, "v": 4.05}, (float(x), float(y))
    found = potto.fit(THROW.landing, start, given={"end": 2.2}, target=target)
    assert found.converged
    assert abs(found["u"] - 1.7) < 1e-6 and abs(found["v"] - 4.1) < 1e-6


@pytest.mark.parametrize("stop", [-0.5, -0.77])
def test_through_the_contact_of_a_thousand_steps(stop: float) -> None:
    found = dual(SPRING, r"\s . released(given with stop = s, 1000, 0.003)", stop)
    agrees(found, reference(lambda s: stepped(s, 1000, mp.mpf(0.003)), stop), 1e-9)


def test_the_stop_is_found() -> None:
    target = float(stepped(mp.mpf(-0.43), 3000, mp.mpf(0.001)))
    found = potto.fit(SPRING.rebound, {"stop": -0.55}, target=target)
    assert found.converged and abs(found["stop"] + 0.43) < 1e-6


@pytest.mark.parametrize("switch", [0.2, 0.75, 1.6])
def test_the_cart_switches(switch: float) -> None:
    agrees(dual(CART, r"\s . place(2, s)", switch), reference(lambda s: 4 * s - s * s - 2, switch), 1e-14)
    agrees(dual(CART, r"\s . speed(2, s)", switch), reference(lambda s: 2 * s - 2, switch), 1e-14)


def test_the_cart_is_parked() -> None:
    found = potto.fit(CART.miss, {"end": 2.0, "switch": 1.2})
    assert found.converged and abs(found["end"] - 3) < 1e-6 and abs(found["switch"] - 1.5) < 1e-6


@pytest.mark.parametrize("speed", [0.8, 1.3])
def test_the_pole_is_held_up(speed: float) -> None:
    with potto.settings(rtol=1e-8):  # a thousand integrals, each with the error of all before
        agrees(dual(POLE, "tilt", speed), reference(lambda s: held(s, 1000), speed), 1e-11)


@pytest.mark.parametrize("set_point", [17.0, 20.0, 22.25])
@pytest.mark.parametrize(("name", "cost"), [("by_set", False), ("cost", True)])
def test_the_room_is_kept_warm(set_point: float, name: str, cost: bool) -> None:
    agrees(dual(ROOM, name, set_point), reference(lambda s: warmed(s, cost), set_point), 1e-12)


def test_the_best_set_point_is_found() -> None:
    with mp.workdps(40):
        best = mp.findroot(lambda s: mp.diff(lambda t: warmed(t, True), s), 19.7)
    found = potto.fit(ROOM.cost, {"set": 20.5})
    assert found.converged and abs(found["set"] - float(best)) < 1e-6
