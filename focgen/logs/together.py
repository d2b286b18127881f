"""What the logs of one session, and the roles of one log, have to have in common."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from focgen.errors import LogError
from focgen.logs.scales import known, same
from focgen.logs.table import LogTable
from focgen.logs.units import unit_of


def check_zones(tables: Sequence[LogTable], name: str) -> None:
    """Raise LogError where some logs have dates with a zone and some without: hours may lie between them."""
    zones = {table.path: table.has_zone(name) for table in tables}
    bare = next((path for path, zone in zones.items() if zone is False), None)
    if bare is not None and True in zones.values():
        what = "has dates without a zone, beside a log with one"
        raise LogError(f"{bare} [{name}]", what, "write the zone in all logs of a session, or in none")


def check_one_unit(tables: Sequence[LogTable], names: Iterable[str], remedy: str) -> None:
    """Raise LogError where two logs give a column in units that differ: its readings would be put together
    as they stand. A log that gives none says nothing."""
    for name in names:
        given = [(table, unit) for table in tables if name in table and (unit := table.unit(name))]
        for table, unit in given[1:]:
            if not alike(unit, given[0][1]):
                what = f"gives {name!r} in {unit}, and {given[0][0].path} in {given[0][1]}"
                raise LogError(table.path, what.replace(";", ","), f"save all logs in one unit, or {remedy}")


def check_own_columns(table: LogTable, named: Mapping[str, str | None]) -> None:
    """Raise LogError where two roles have one column, by two names of it: the stage between them would be 1.
    ``named``: the column of each role."""
    roles: dict[str, str] = {}
    for role, name in named.items():
        if name is None or name not in table:
            continue
        first = roles.setdefault(table.own(name), role)
        if first != role and named[first] != name:  # a rig's file has refused one name twice
            what = f"has one column for {first} and {role}: {named[first]!r} and {name!r} are names of it"
            remedy = "give each role its own column in the rig's [signals], and leave out what is not logged"
            raise LogError(table.path, what.replace(";", ","), remedy)


def alike(given: str, taken: str) -> bool:
    """Whether two units are the same, however they are spelled; what nobody knows is alike to nothing."""
    if given == taken:
        return True
    if known(given) and known(taken):
        return same(given, taken)
    read = unit_of(given)
    return read is not None and read == unit_of(taken)
