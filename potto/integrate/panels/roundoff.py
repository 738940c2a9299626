"""What rounding does to the integral over a piece.

Owns `shake`, `few_doubles` and `coarse` (of nodes), `share`, `part_of`, `worst_part` and `noise` (of the integrand),
`misplaced`, `note_ends` and `hidden_steps` (of the ends of segments) and `together` (of derivatives that move with the
nodes).
"""

from __future__ import annotations

import numpy as np

from potto.integrate.pieces import Ends, Pieces
from potto.integrate.rules import substitution
from potto.integrate.rules.gauss import EPS, GaussRule
from potto.integrate.rules.substitution import Segments
from potto.kernels.cells import Array, Ints

# The rounding of a node, in units of the last place, that noise in a steep integrand is blamed on.
NODE_ROUNDING = 0.5
# From how many lengths of a piece away from 0 on the rounding of its nodes is put right.
FAR = 8
# From which part of a segment's length on the rounding of nodes is averaged out by many; of how many segments.
COARSE, MANY = 1e-6, 0.25
# Up to which part of its size two interpolants of one integrand differ at their common end by their rounding; from
# which on that is a jump, which is looked for where cuts move in different ways (`degenerate.degeneracies`).
SMOOTH, STEP = 1e-13, 1e-6
# Places within a range, as parts of it, that tell the rounding of an integrand: there not all is 0, or stands still, by
# symmetry; and others beside its ends: all that what is cut out as a layer does it does within an eightieth of it.
WITHIN = np.array((0.309, 0.618))
ASIDE = np.array((0.012, 0.988))
LOOKED_AT = 64  # how many ranges are looked at within, if there are more


def few_doubles(seg: Segments, weight: Array) -> bool:
    """Whether pieces are so far from 0 for their length that the rounding of nodes is worth putting right."""
    far = np.maximum(np.abs(seg.a), np.abs(seg.b))
    return bool((NODE_ROUNDING * far > FAR * weight[:, 0]).any())


def coarse(seg: Segments) -> bool:
    """Whether doubles are COARSE in MANY of the segments: all that there is may be within these."""
    far = np.maximum(np.abs(seg.a), np.abs(seg.b))
    return bool((NODE_ROUNDING * EPS * far > COARSE * (seg.b - seg.a)).mean() >= MANY)


def shake(p: Pieces, seg: Segments, x: Array, weight: Array, put_right: bool) -> Array:
    """The rounding of nodes, as a part of the piece: (P,).

    Far from 0, where few doubles lie in a piece, a node is not where the rule wants it; but how far off it is is
    known exactly, and the interpolant's slope puts that right but for its square.
    """
    if weight.shape[1] > 1:
        shake = NODE_ROUNDING * EPS * np.abs(x).max(axis=-1) / np.abs(weight).max(axis=-1)
    else:
        shake = NODE_ROUNDING * EPS * np.maximum(np.abs(seg.a), np.abs(seg.b)) / weight[:, 0]
        if put_right:
            shake = np.minimum(shake, shake * shake + 2 * EPS * p.u1 / (p.u1 - p.u0))
    return np.where(shake <= 1.0, shake, np.where(np.isfinite(shake), 1.0, 0.0))


def share(f: Array, e: Array) -> Array:
    """Which part of numbers their errors are; infinite where nothing is left of them."""
    part: Array = np.divide(e, np.abs(f), out=np.full(f.shape, np.inf), where=(f != 0) & np.isfinite(f))
    return part


def part_of(size: Array, off: Array) -> Array:
    """The same of numbers added up at places, and 0 where their errors are."""
    return np.where(off > 0, share(size, off), 0.0)


def worst_part(size: Array, off: Array) -> Array:
    """The larger part of numbers (..., 4) at WITHIN and ASIDE, two by two, that their errors are."""
    within, aside = (part_of(size[..., two].sum(axis=-1), off[..., two].sum(axis=-1)) for two in ([0, 1], [2, 3]))
    return np.maximum(within, aside)


def noise(ends: Ends, width: int, p: Pieces, seg: Segments) -> Array:
    """What the integrand's own rounding, kept track of at places of segments, comes to in each channel: (C, P).

    More than a few units in the last place where terms of parameters cancel, or where sines of them have large
    arguments. What only grows towards one end is rounding of the variable, which is counted elsewhere.
    """
    part = ends.share[:, p.segment]
    part = np.where((part > 4 * EPS) & (part < 1), part, 0.0)
    part = np.where(seg.kind == substitution.BOTH, 0.0, part)  # at a turning point little is left to be rounded
    sizes = p.size.reshape(width, -1, p.u0.size)
    return np.asarray((part[:, None] * sizes).reshape(p.size.shape))


def misplaced(p: Pieces, seg: Segments, at_ends: Array) -> tuple[Ints, Array]:
    """What is gained or lost in the fixed form as the ends of whole segments are off by a rounding.

    The interior derivative jumps where the integrand has a kink; next to a place where sections turn it is as large as
    one likes. at_ends: the channels of the interior derivative at both ends (m, k, P, 2). Returns the pieces that are
    whole segments (I,), and what it is for each (m, k, I).
    """
    index = np.nonzero((p.u0 == 0) & (p.u1 == 1) & (p.end == 0))[0]
    part, u = seg.pick(index), np.array([[0.0, 1.0]])
    slope = np.abs(np.broadcast_to(substitution.points(part, u)[1], (index.size, 2)))
    turn, end = np.stack((part.left, part.right), axis=1), np.stack((part.a, part.b), axis=1)
    rounded = np.where(np.isfinite(turn), EPS * np.abs(turn), 0.0)
    off = np.stack((part.ea, part.eb), axis=1) + rounded
    with np.errstate(invalid="ignore"):  # of an end that is the turning place itself the map takes care
        counts = (slope > 0) & np.isfinite(slope) & (end != turn)
    share = np.divide(off, slope, out=np.zeros_like(off), where=counts)
    lost = np.abs(at_ends[:, :, index]) * np.minimum(share, 1.0)
    return index, np.where(np.isfinite(lost), lost, 0.0).sum(axis=-1)


def note_ends(at_ends: Array, p: Pieces, seg: Segments, coefficients: Array, rule: GaussRule) -> None:
    """Put down what the integrand, and how steep it, is at the ends of segments, (2, m, 2, all segments), by the pieces
    there: 0 where a map or a grade makes that unknown.

    coefficients: (m, P, n) of its values times the length of each piece.
    """
    length = ((seg.b - seg.a) * (p.u1 - p.u0))[:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        value = coefficients @ rule.ends / length
        slope = np.abs(coefficients @ (rule.slopes[:, None] * rule.ends)) / (length * length)
    found = np.stack((value, slope))
    plain = (p.end == 0) & (seg.kind == substitution.LINEAR) & np.isfinite(found).all(axis=(0, 1, 3))
    found = np.where(plain[:, None], found, 0.0)
    for upper, there in enumerate((p.u0 == 0, p.u1 == 1)):
        at_ends[:, :, upper, p.segment[there]] = found[..., there, upper]


def hidden_steps(at_ends: Array, seg: Segments, jumps: bool) -> Array:
    """What is left out where an integrand that is said to bend at cuts takes a step across several that rounding takes
    for one, (m, k, S) by the segment above: the step times how fast it moves. jumps: only what is not a plain jump."""
    before, after = at_ends[0][:, 1, :-1], at_ends[0][:, 0, 1:]
    size = np.abs(before) + np.abs(after)
    step = np.abs(after - before)
    merged = (seg.owner[1:] == seg.owner[:-1]) & (seg.a[1:] == seg.b[:-1]) & (seg.rank[1:] == 1) & (seg.blur[0, 1:] > 0)
    merged &= (seg.kind[1:] == substitution.LINEAR) & (seg.kind[:-1] == substitution.LINEAR)
    counts = merged & (step > SMOOTH * size) & (jumps | (step <= STEP * size))
    lost: Array = np.zeros((at_ends.shape[1], seg.ta.shape[0], seg.a.size))
    with np.errstate(invalid="ignore"):
        lost[:, :, 1:] = np.where(counts, step, 0.0)[:, None] * np.abs(seg.ta[:, 1:])
    return np.where(np.isnan(lost), 0.0, lost)


def together(common: Array, tangents: Array, v: Array, d: int) -> Array:
    """How much less D F/D theta + v dF/dx errs than its two parts by themselves, by a factor that they share: next to a
    fold, where both are as large as one likes, what they come to is not.

    tangents: (m, k + 1, P, n), the last of them dF/dx; common: their errors that are due to such a factor.
    """
    ft, fx = tangents[:, d], tangents[:, -1]
    apart = common[:, d] + np.abs(v) * common[:, -1]
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = np.fmax(common[:, d] / np.abs(ft), common[:, -1] / np.abs(fx))
        joint = np.fmin(factor, 1.0) * np.abs(ft + v * fx)
    return np.where(np.isfinite(joint), np.maximum(apart - joint, 0.0), 0.0)
