"""Changes of Python: comparisons, arithmetic, constants, conditions, ends of ranges."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from tests.mutants.change import Change

_COMPARED = {
    ast.Lt: ("<", ("<=", ">")),
    ast.LtE: ("<=", ("<", ">=")),
    ast.Gt: (">", (">=", "<")),
    ast.GtE: (">=", (">", "<=")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
}
_COMPUTED = {
    ast.Add: ("+", ("-",)),
    ast.Sub: ("-", ("+",)),
    ast.Mult: ("*", ("/", "+")),
    ast.Div: ("/", ("*",)),
    ast.FloorDiv: ("//", ("*",)),
    ast.Mod: ("%", ("*",)),
    ast.Pow: ("**", ("*",)),
    ast.LShift: ("<<", (">>",)),
    ast.RShift: (">>", ("<<",)),
    ast.BitAnd: ("&", ("|",)),
    ast.BitOr: ("|", ("&",)),
}
_OPPOSITES = ("min max", "minimum maximum", "floor ceil", "any all", "low high", "first last", "real imag")
_OTHER = {a: b for pair in map(str.split, _OPPOSITES) for a, b in (pair, pair[::-1])}


def changes(file: str, text: str) -> list[Change]:
    """Every change of one file; a few of them are no Python any longer (:func:`compiles`)."""
    found = _Finder(file, text)
    found.visit(ast.parse(text))
    return found.changes


def compiles(text: str) -> bool:
    """Whether a file can be loaded at all."""
    try:
        compile(text, "changed", "exec", dont_inherit=True)
    except (SyntaxError, ValueError):
        return False
    return True


class _Finder(ast.NodeVisitor):
    """Walks a module; what is raised, said, annotated or decorates is no mathematics and left alone."""

    def __init__(self, file: str, text: str):
        self.file, self.text, self.changes = file, text, []
        self.starts = [0]
        for line in text.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))

    def at(self, line: int, column: int) -> int:
        """The character at a node's place, whose column is counted in bytes."""
        start = self.starts[line - 1]
        whole = self.text[start : self.starts[line]].encode()
        return start + len(whole[:column].decode())

    def begin(self, node: ast.AST) -> int:
        return self.at(node.lineno, node.col_offset)

    def end(self, node: ast.AST) -> int:
        return self.at(node.end_lineno, node.end_col_offset)

    def add(self, begin: int, old: str, news, kind: str) -> None:
        self.changes += [Change(self.file, begin, old, new, kind) for new in news]

    def between(self, left: ast.AST, right: ast.AST, old: str, news, kind: str) -> None:
        """Change an operator that stands between two operands."""
        place = self.text.find(old, self.end(left), self.begin(right))
        if place >= 0:
            self.add(place, old, news, kind)

    def visit_Raise(self, node: ast.Raise) -> None: ...

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None: ...

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value:
            self.visit(node.value)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        for part in (*node.args.defaults, *filter(None, node.args.kw_defaults), *node.body):
            self.visit(part)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for part in node.body:
            self.visit(part)

    def visit_Compare(self, node: ast.Compare) -> None:
        for left, op, right in zip([node.left, *node.comparators], node.ops, node.comparators):
            self.between(left, right, *_COMPARED[type(op)], "comparison")
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if type(node.op) in _COMPUTED and not isinstance(node.left, ast.JoinedStr):
            self.between(node.left, node.right, *_COMPUTED[type(node.op)], "arithmetic")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        if type(node.op) in _COMPUTED:
            old, news = _COMPUTED[type(node.op)]
            self.between(node.target, node.value, old + "=", [new + "=" for new in news], "arithmetic")
        self.visit(node.value)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        for left, right in zip(node.values, node.values[1:]):
            self.between(left, right, f" {old} ", [f" {new} "], "condition")
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        old = {ast.USub: "-", ast.Not: "not ", ast.Invert: "~"}.get(type(node.op))
        if old and self.text.startswith(old, self.begin(node)):
            self.add(self.begin(node), old, [""], "sign or negation lost")
        self.generic_visit(node)

    def visit_If(self, node: ast.If) -> None:
        self.negated(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self.negated(node.test)
        self.generic_visit(node)

    def negated(self, test: ast.expr) -> None:
        """A condition that is no comparison is turned round as a whole."""
        if isinstance(test, (ast.Name, ast.Attribute, ast.Call)):
            old = self.text[self.begin(test) : self.end(test)]
            self.add(self.begin(test), old, [f"not {old}"], "condition")

    def visit_Constant(self, node: ast.Constant) -> None:
        value, old = node.value, self.text[self.begin(node) : self.end(node)]
        if isinstance(value, bool):
            self.add(self.begin(node), old, [str(not value)], "constant")
        elif isinstance(value, int):
            self.add(self.begin(node), old, [str(value + 1), str(value - 1)], "constant")
        elif isinstance(value, float):
            news = [repr(x) for x in (1.0 + value, 2.0 * value) if x != value]
            self.add(self.begin(node), old, news, "constant")

    def visit_Name(self, node: ast.Name) -> None:
        if node.id in ("min", "max", "any", "all"):
            self.add(self.begin(node), node.id, [_OTHER[node.id]], "the other end")

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if node.attr in _OTHER and isinstance(node.ctx, ast.Load):
            self.add(self.end(node) - len(node.attr), node.attr, [_OTHER[node.attr]], "the other end")
        self.visit(node.value)

    def visit_Expr(self, node: ast.Expr) -> None:
        """A call whose value nobody takes is left out; strings by themselves are documentation."""
        if isinstance(node.value, ast.Call) and node.lineno == node.end_lineno:
            self.add(self.begin(node), self.text[self.begin(node) : self.end(node)], ["pass"], "call lost")
        if not isinstance(node.value, ast.Constant):
            self.visit(node.value)


def lines_of(text: str, line: int) -> range:
    """The lines of the smallest statement around one, all of which coverage may count it under."""
    found = range(line, line + 1)
    spans = [
        range(n.lineno, (n.body[0].lineno if getattr(n, "body", None) else n.end_lineno + 1))
        for n in ast.walk(ast.parse(text))
        if isinstance(n, ast.stmt) and n.lineno <= line <= n.end_lineno
    ]
    holding: Iterator[range] = (s for s in spans if line in s)
    return min(holding, key=len, default=found)
