"""`potto.to_torch` under PyTorch itself. `make test-bridges` installs it; without it these tests are skipped."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest

import potto
from potto.bridges.flat import FlatFunction

torch = pytest.importorskip("torch", reason="PyTorch is not installed: `make test-bridges` runs these tests")

m = potto.compile(r"""
record Lens(width: Real, height: Real)

def area(a, c)
    integral [0, 1] a*[x < c^2]*exp(x) d(x)

def quadratic(xs: [n] Real, p: (Real, Real), k)
    k*sum i in 0..n-1 ((i + 1)*xs[i]^2) + p.0^2*p.1

def two(a, b)
    (a*b, a^2)

def lens(q: Lens, t)
    q.width*q.height^2*t

def shaded(shader)(c)
    integral [0, 1] shader(x)*[x < c] d(x)

square = \x . x^2
""")
E = math.exp(0.25)


def real(*numbers: float) -> Any:
    return torch.tensor(numbers if len(numbers) > 1 else numbers[0], dtype=torch.float64, requires_grad=True)


@pytest.fixture(scope="module")
def area() -> Any:
    return potto.to_torch(m.area)


def test_values_and_backward(area: Any) -> None:
    a, c = real(2), real(0.5)
    found = area(a, c)
    found.backward()
    assert found.item() == pytest.approx(2 * (E - 1), rel=1e-12)
    assert (a.grad.item(), c.grad.item()) == pytest.approx((E - 1, 2 * E), rel=1e-10)


def test_they_pickle_also_within_a_module() -> None:
    class Lit(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.c = torch.nn.Parameter(torch.tensor(0.5, dtype=torch.float64))
            self.area = potto.to_torch(m.area, given={"a": 2.0})

        def forward(self) -> Any:
            return self.area(c=self.c)

    area = copy.deepcopy(Lit())
    area.area = pickle.loads(pickle.dumps(area.area))
    assert area.area.__name__ == "area" and "to_torch" in repr(area.area)
    area().backward()
    assert area.c.grad.item() == pytest.approx(2 * E, rel=1e-10)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("area", ((2,), (0.2, 0.5, 0.7))),
        ("quadratic", ((1, 2, 3), (1, 2), (0.5,))),
        ("two", ((1,), (1, 2))),
    ],
)
def test_the_checks_of_torch_itself(name: str, arguments: Any) -> None:
    function, given = potto.to_torch(getattr(m, name)), tuple(real(*numbers) for numbers in arguments)
    assert torch.autograd.gradcheck(
        function, given, check_forward_ad=True, check_batched_grad=True, check_batched_forward_grad=True
    )
    assert torch.autograd.gradgradcheck(function, given)


def test_transforms_of_functions(area: Any) -> None:
    func, a, c = torch.func, real(2).detach(), real(0.5).detach()
    assert func.hessian(area, 1)(a, c).item() == pytest.approx(6 * E)
    assert func.jvp(area, (a, c), (torch.ones_like(a), 3 * torch.ones_like(c)))[1].item() == pytest.approx(7 * E - 1)
    assert [x.item() for x in func.vjp(area, a, c)[1](torch.ones_like(a))] == pytest.approx([E - 1, 2 * E])
    cs = torch.linspace(0.1, 0.9, 5, dtype=torch.float64)
    second = func.vmap(func.hessian(area, 1), (None, 0))(a, cs).numpy()
    expected = 4 * np.exp(cs.numpy() ** 2) * (1 + 2 * cs.numpy() ** 2)
    assert second == pytest.approx(expected)


def test_a_batch_is_one_call(area: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    slopes = FlatFunction.slopes
    monkeypatch.setattr(FlatFunction, "slopes", lambda self, *args: calls.append(1) or slopes(self, *args))
    cs = torch.linspace(0.1, 0.9, 50, dtype=torch.float64)
    found = torch.func.vmap(torch.func.grad(area, 1), (None, 0))(real(2).detach(), cs)
    assert found.numpy() == pytest.approx(4 * cs.numpy() * np.exp(cs.numpy() ** 2), rel=1e-10)
    assert len(calls) == 1


def test_records_and_arrays() -> None:
    q = {"width": real(1.5), "height": real(2)}
    potto.to_torch(m.lens)(q, 3.0).backward()
    assert (q["width"].grad.item(), q["height"].grad.item()) == (12, 18)
    xs = torch.arange(12.0, dtype=torch.float64).reshape(4, 3).requires_grad_()
    potto.to_torch(m.quadratic)(xs, (1.0, 2.0), 2.0).sum().backward()
    assert xs.grad.numpy() == pytest.approx(4 * np.array([1.0, 2, 3]) * xs.detach().numpy())


def test_functions_are_given_at_once_and_errors_come_along() -> None:
    shaded = potto.to_torch(m.shaded, given={"shader": m.square}, error=True)
    c = real(0.6)
    value, error = shaded(c)
    assert value.item() == pytest.approx(0.072) and error.item() >= 0 and not error.requires_grad
    value.backward()
    assert c.grad.item() == pytest.approx(0.36)


def test_precision_is_that_of_the_arguments(area: Any) -> None:
    assert area(torch.tensor(2.0), 0.5).dtype == torch.float32
    assert area(real(2), 0.5).dtype == torch.float64


def test_compiled_programs_call_it(area: Any) -> None:
    doubled = torch.compile(lambda a, c: 2 * area(a, c), backend="aot_eager")
    a, c = real(2), real(0.5)
    doubled(a, c).backward()
    assert c.grad.item() == pytest.approx(4 * E)


def test_third_derivatives_are_refused(area: Any) -> None:
    c = real(0.5)
    (first,) = torch.autograd.grad(area(2.0, c), c, create_graph=True)
    (second,) = torch.autograd.grad(first, c, create_graph=True)
    with pytest.raises(potto.PottoError, match="no third ones"):
        torch.autograd.grad(second, c)


def test_a_fit_with_an_optimizer() -> None:
    target = 2 * (math.exp(0.09) - 1)
    area, c = potto.to_torch(m.area), real(0.8)
    optimizer = torch.optim.LBFGS([c], max_iter=50, line_search_fn="strong_wolfe", tolerance_grad=1e-14)

    def loss() -> Any:
        optimizer.zero_grad()
        found = (area(2.0, c) - target) ** 2
        found.backward()
        return found

    optimizer.step(loss)
    assert abs(c.item()) == pytest.approx(0.3, abs=1e-6)  # of c^2


def test_answers_become_tensors() -> None:
    one, several = m.area(2.0, 0.5), m.area(2.0, np.array([0.2, 0.5]))
    assert torch.tensor(one).item() == torch.as_tensor(one).item() == float(one)
    assert torch.as_tensor(several).tolist() == torch.from_dlpack(several).tolist() == several.value.tolist()


def test_a_tensor_that_needs_a_gradient_is_refused_with_what_keeps_it() -> None:
    with pytest.raises(potto.PottoError, match=r"`potto\.to_torch\(f\)` makes `f` one"):
        m.area(real(2), real(0.5))
