"""Core terms: what programs mean, with nothing left of how they were written.

The one name by which the rest of Potto imports them: the closed union and its constructors (`kinds`), arithmetic that
folds (`folding`), and walking (`walking`).
"""

from potto.core.folding import add as add
from potto.core.folding import apply as apply
from potto.core.folding import div as div
from potto.core.folding import mul as mul
from potto.core.folding import neg as neg
from potto.core.folding import pow_ as pow_
from potto.core.folding import sub as sub
from potto.core.kinds import INF as INF
from potto.core.kinds import ONE as ONE
from potto.core.kinds import PI as PI
from potto.core.kinds import ZERO as ZERO
from potto.core.kinds import App as App
from potto.core.kinds import Branch as Branch
from potto.core.kinds import Const as Const
from potto.core.kinds import Delta as Delta
from potto.core.kinds import Deriv as Deriv
from potto.core.kinds import Global as Global
from potto.core.kinds import Hole as Hole
from potto.core.kinds import If as If
from potto.core.kinds import Integral as Integral
from potto.core.kinds import Lam as Lam
from potto.core.kinds import ListOf as ListOf
from potto.core.kinds import Prim as Prim
from potto.core.kinds import Proj as Proj
from potto.core.kinds import Sum as Sum
from potto.core.kinds import Term as Term
from potto.core.kinds import Tuple as Tuple
from potto.core.kinds import Var as Var
from potto.core.kinds import app as app
from potto.core.kinds import branch as branch
from potto.core.kinds import const as const
from potto.core.kinds import delta as delta
from potto.core.kinds import deriv as deriv
from potto.core.kinds import function_of as function_of
from potto.core.kinds import global_ as global_
from potto.core.kinds import hole as hole
from potto.core.kinds import if_ as if_
from potto.core.kinds import integral as integral
from potto.core.kinds import lam as lam
from potto.core.kinds import list_of as list_of
from potto.core.kinds import prim as prim
from potto.core.kinds import proj as proj
from potto.core.kinds import sum_ as sum_
from potto.core.kinds import tuple_ as tuple_
from potto.core.kinds import var as var
from potto.core.kinds import with_integrand as with_integrand
from potto.core.walking import Holding as Holding
from potto.core.walking import bound_apart as bound_apart
from potto.core.walking import bound_names as bound_names
from potto.core.walking import children as children
from potto.core.walking import fresh as fresh
from potto.core.walking import outside as outside
from potto.core.walking import postorder as postorder
from potto.core.walking import postorder_by as postorder_by
from potto.core.walking import rebuild as rebuild
from potto.core.walking import rename_bound as rename_bound
from potto.core.walking import replaced as replaced
from potto.core.walking import substitute as substitute
from potto.core.walking import transform as transform
from potto.core.walking import unknown as unknown
