"""Functions over lanes again for a single vehicle, with their arithmetic written out.

A model is one function for one vehicle and for many, and asks an `Ops` for all that floats and
arrays do not have in common. For one vehicle those calls cost more than the arithmetic. `for_one`
compiles a function again with expressions in their places, `o.maximum(x, y)` as
`x if x > y else y`, and so gives the same bits as the function with `lanes.Ops`. Nothing else about
it changes; without its source it is used as it is.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable
from functools import cache
from types import FunctionType, ModuleType
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])

_OPS = "o"
"""The argument that is an `Ops`"""
_MATH = {"sqrt": math.sqrt, "hypot": math.hypot, "atan2": math.atan2, "sin": math.sin}
_MATH |= {"cos": math.cos}
_WRITTEN = {
    "minimum": "{0} if {0} < {1} else {1}",
    "maximum": "{0} if {0} > {1} else {1}",
    "clip": "{1} if {0} < {1} else {2} if {0} > {2} else {0}",
    "where": "{1} if {0} else {2}",
}
"""As `lanes.Ops` has them"""
_LAZY = {"where": (1, 2)}
"""Arguments that need not be worked out before"""


def for_one(function: F) -> F:
    """The same function, for floats.

    Args:
        function: with an argument `o`, to which it gives no other name; what it calls with one is
            written out, too.
    """
    return cast(F, _for_one(function))


@cache
def _for_one(function: Callable[..., Any]) -> Callable[..., Any]:
    try:
        source = textwrap.dedent(inspect.getsource(function))
    except OSError:  # nobody has it: an archive, or compiled files alone
        return function
    assert isinstance(function, FunctionType)
    tree = ast.parse(source)
    scope: dict[str, Any] = dict(function.__globals__)
    tree = ast.fix_missing_locations(_WriteOut(scope).visit(tree))
    ast.increment_lineno(tree, function.__code__.co_firstlineno - 1)
    exec(compile(tree, function.__code__.co_filename, "exec", dont_inherit=True), scope)
    return cast(Callable[..., Any], scope[function.__name__])


class _WriteOut(ast.NodeTransformer):
    """Rewrites one function.

    Args:
        scope: what its names mean; what the new ones mean is added.
    """

    def __init__(self, scope: dict[str, Any]) -> None:
        self._scope = scope
        self._scope |= {f"_one_{name}": value for name, value in _MATH.items()}
        self._scope |= {"_one_tuple": tuple.__new__, "_one_remainder": math.remainder}
        self._names = 0

    def visit_arg(self, node: ast.arg) -> ast.AST:
        """Annotations are of no use any more, and may not be evaluated."""
        node.annotation = None
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Without what it is annotated with."""
        node.returns = None
        return self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Another function over lanes."""
        return self._replaced(node, self._scope.get(node.id))

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """The same, of a module."""
        if isinstance(node.value, ast.Name):
            module = self._scope.get(node.value.id)
            if isinstance(module, ModuleType):
                return self._replaced(node, getattr(module, node.attr, None))
        return self.generic_visit(node)

    def _replaced(self, node: ast.expr, meant: Any) -> ast.expr:
        if not isinstance(meant, FunctionType) or _OPS not in inspect.signature(meant).parameters:
            return node
        name = f"_one_{meant.__module__.replace('.', '_')}_{meant.__name__}"
        self._scope[name] = _for_one(meant)
        return ast.copy_location(ast.Name(name, ast.Load()), node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Arithmetic, and records that are made."""
        called = node.func
        self.generic_visit(node)
        if isinstance(called, ast.Attribute) and isinstance(called.value, ast.Name):
            if called.value.id == _OPS:
                return ast.copy_location(self._arithmetic(called.attr, node), node)
        elif isinstance(called, ast.Name) and self._is_record(called.id, node):
            made = ast.Tuple(node.args, ast.Load())
            node.func, node.args = ast.Name("_one_tuple", ast.Load()), [called, made]
        return node

    def _is_record(self, name: str, node: ast.Call) -> bool:
        """Whether it makes a NamedTuple of all its fields in their order."""
        kind = self._scope.get(name)
        if not isinstance(kind, type) or not issubclass(kind, tuple):
            return False
        plain = not any(isinstance(value, ast.Starred) for value in node.args)
        return plain and len(node.args) == len(getattr(kind, "_fields", ()))

    def _arithmetic(self, name: str, node: ast.Call) -> ast.expr:
        if name in _MATH:
            node.func = ast.Name(f"_one_{name}", ast.Load())
            return node
        if name == "wrap_pi":
            node.func = ast.Name("_one_remainder", ast.Load())
            node.args.append(ast.Constant(math.tau))
            return node
        if name == "full":
            return ast.Call(ast.Name("float", ast.Load()), node.args, [])
        if name not in _WRITTEN:
            return node
        return self._written(name, node.args)

    def _written(self, name: str, values: list[ast.expr]) -> ast.expr:
        """An expression in which what is used twice is worked out once, where it comes first."""
        lazy, slots = _LAZY.get(name, ()), [f"_one_{place}" for place in range(len(values))]
        expression = ast.parse(_WRITTEN[name].format(*slots), mode="eval").body
        for place, value in enumerate(values):
            if isinstance(value, ast.Name | ast.Constant) or place in lazy or name == "where":
                filler = _Fill(slots[place], value, None)
            else:
                self._names += 1
                filler = _Fill(slots[place], value, f"_one_value_{self._names}")
            expression = filler.visit(expression)
        return expression


class _Fill(ast.NodeTransformer):
    """Puts a value into its slot: named where it is worked out first, if there is a name."""

    def __init__(self, slot: str, value: ast.expr, name: str | None) -> None:
        self._slot, self._value, self._name = slot, value, name
        self._named = False

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        """The condition comes first."""
        node.test = self.visit(node.test)
        node.body = self.visit(node.body)
        node.orelse = self.visit(node.orelse)
        return node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """The slot itself."""
        if node.id != self._slot:
            return node
        if self._name is None:
            return self._value
        if self._named:
            return ast.Name(self._name, ast.Load())
        self._named = True
        return ast.NamedExpr(ast.Name(self._name, ast.Store()), self._value)
