"""Programs that the syntax tests share: the paper's listings to the letter, and one that has every construct."""

from __future__ import annotations

PAPER: dict[str, str] = {
    "half_plane.diffeo": r"""# a diffeomorphism of (x, y), with the parameter c
cond = \(x, y) . \c . (x + y + c, x - y + c)
""",
    "color_shaders.po": r"""dconst_shader = deriv(\(x,y) . c. 1)
dlin_shader   = deriv(\(x,y) . c.
    1/(sqrt(2)*(x+y+c)+2))
dquad_shader  = deriv(\(x,y) . c.
    1/(sqrt(2)*(x+y+c)+2)^2)
""",
    "renderer.po": """from half_plane import cond
def renderer(c, shader)
    integral ([0,1], [0,1])
        ((shader (x,y)) c)
        *(((cond (x, y)) c)?1:0) d(x,y)
drenderer = deriv(renderer)
""",
    "main.po": """from color_shaders import dconst_shader,
    dlin_shader, dquad_shader
from renderer import drenderer
for dshader in [dconst_shader,
    dlin_shader, dquad_shader]:
    print(drenderer(dc=(-2,1), dshader))
""",
}

CONSTRUCTS = r"""# every construct once
import m as k
import pkg.m
from pkg.m import (a, b as c,)

def fact(n) if n > 0 then n*fact(n-1) else 1

def f(a: Real, shader: (Real*, y: Real*) -> Real -> Real, q: Real[x, y])(k: [Real], z: (Real, Diffeo[2])) -> Dist[x]
    y = a   # a local name
    (b, c) = (1, 2.5e-3)
    # the result
    -b^2 + 2^-1 - y*(c + f(a=1, b))

diffeo polar(x, y; c) = (sqrt(x^2+y^2) - c, atan2(y, x))
    inverse (u, v) . ((u + c)*cos(v), (u + c)*sin(v))
    where x > 0, y > 0

diffeo straight(x, y) =
    r = x + y
    (r, x - y)
    where x > 0

h = integral (x ~ normal(m, s), [0, 1]) body d(x, y)
s = sum i in 1..n (i^2) + 3
q = [x < t] + [a <= x < b] - fst [a, b] / exp(x) [p and not q or r]
l = let a = 1; (b, c) = f(a) in a + b
g = (let u = 1
     v = 2
     in u*v)
w = if diffeo(x + y, x) then \x.x else λ y . m.f y
c: Real = 3
z = a ? b : c ? d : e
i = ∫ [-inf, inf] delta(x - θ)*exp(-x^2) d(x)
o = \(x, y) . c. (x, y, c)

for v in [1, 2, 3]:
    w = v + 1
    print(v, w)
    for u in [w]
        u*v
#> f(2)
#= 3
f (2) 3
"""

SAMPLES = {**PAPER, "constructs.po": CONSTRUCTS}
