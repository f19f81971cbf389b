"""All indices that can be named, and how a set of them is given.

    J2_1                      one of them
    J2, FEIamp                all places of one
    benchmark, true, ...      a group of the table, see ``GROUPS``
    package.module:NAME       an ``Index``, or a tuple of them, of one's own that can be imported
    path/file.py:NAME         the same out of a file, whose code is run to load it
    path/file.py              all that stand in a file by themselves

From Python an ``Index`` may stand there itself.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache

from martths_jax.errors import InputError
from martths_jax.guests import Place, absent, is_place, load
from martths_jax.indices import benchmark, frequency, tracking, true_stroke, uniaxial
from martths_jax.indices.base import Index
from martths_jax.layout import Layout

#: What can be named beside the indices: the group of each file.
GROUPS = {
    "benchmark": benchmark.INDICES,
    "true": true_stroke.INDICES,
    "tracking": tracking.INDICES,
    "frequency": frequency.INDICES,
}
KNOWN = {index.name: index for group in GROUPS.values() for index in group}
#: Tables that a problem names (``Layout.table``): what stands in place of the benchmark's indices,
#: or beside them.
TABLES = {"": {}, "uniaxial": uniaxial.GROUPS}
_BY_ACTUATOR = {"true": true_stroke, "tracking": tracking, "frequency": frequency}
#: What of one's own can be named, to complete "Give ...".
WAYS = "package.module:NAME or path/file.py:NAME"
#: What runs if nothing is said.
DEFAULT = ("benchmark",)


@lru_cache
def groups_of(layout: Layout | None = None) -> Mapping[str, tuple[Index, ...]]:
    """Groups of a problem's indices by name; without one, of the maRTHS benchmark."""
    if layout is None:
        return GROUPS
    n = len(layout.interface)
    own = benchmark.indices_for(
        layout.actuators, layout.interface, layout.outputs[n:], layout.paper
    )
    of = {name: file.indices_for(layout.actuators) for name, file in _BY_ACTUATOR.items()}
    return {"benchmark": own} | of | TABLES[layout.table]


@lru_cache
def known_of(layout: Layout | None = None) -> Mapping[str, Index]:
    """A problem's indices by name."""
    return {i.name: i for group in groups_of(layout).values() for i in group}


def choose(
    given: Iterable[str | Index] | str | Index = DEFAULT, layout: Layout | None = None
) -> tuple[Index, ...]:
    """The indices that are meant, each once, in the order in which they were named.

    Args:
        given: names, groups and ``Index`` objects; or a single one; or names between commas.
        layout: of the problem; by default the maRTHS benchmark's.

    Raises:
        InputError: listing every name that is unknown or taken twice.
    """
    if isinstance(given, str):
        given = [word.strip() for word in given.split(",")]
    elif isinstance(given, Index):
        given = [given]
    found: dict[str, Index] = {}
    known, problems = known_of(layout), []
    for one in given:
        try:
            for index in _meant(one, layout):
                same = found.get(index.name, known.get(index.name, index))
                if same != index:
                    raise InputError(
                        f"Two indices are called {index.name!r}; give your own another name."
                    )
                found[index.name] = index
        except InputError as error:
            problems.append(str(error))
    if not found and not problems:
        problems = ["Argument `indices` must name at least one index, such as benchmark or J2_1."]
    if problems:
        raise InputError("\n".join(problems))
    return tuple(found.values())


def files_of(given: Iterable[str | Index]) -> dict[str, Place]:
    """Those of some names that stand for a file, and what lies there."""
    texts = [one for one in given if isinstance(one, str) and is_place(one)]
    places = {text: load(text, "Index", WAYS) for text in texts}
    return {text: place for text, place in places.items() if place.file is not None}


def units_in_words(indices: Iterable[Index]) -> str:
    """Which units the values of some indices have, as in "J1, J4 in ms, the others in %"."""
    groups: dict[str, list[str]] = {}
    for index in indices:
        groups.setdefault(index.unit, []).append(index.group)
    usual = max(groups, key=lambda unit: len(groups[unit]))
    rare = [f"{', '.join(dict.fromkeys(g))} in {u}" for u, g in groups.items() if u != usual]
    return ", ".join([*rare, f"{'the others' if rare else 'all'} in {usual}"])


def shown_of(asked: Iterable[str], usual: tuple[str, ...], names: Sequence[str]) -> tuple[str, ...]:
    """Names of the indices that figures and summaries show.

    Args:
        asked: by the user, or `usual` where nothing was asked for.
        usual: what is shown of a run that has it all; else its first indices.
        names: of the run's indices.
    """
    asked = tuple(dict.fromkeys(asked))
    if asked != usual:
        return asked
    return tuple(n for n in usual if n in names) or tuple(names[: len(usual)])


def _meant(one, layout: Layout | None) -> Iterator[Index]:
    groups, known = groups_of(layout), known_of(layout).values()
    if isinstance(one, Index):
        return iter((one,))
    if not isinstance(one, str):
        raise InputError(
            f"Argument `indices` must hold names and Index objects, but got {type(one).__name__}."
        )
    word = one.casefold()
    if word in groups:
        return iter(groups[word])
    named = [i for i in known if word in (i.name.casefold(), i.group.casefold())]
    if named:
        return iter(named)
    if is_place(one):
        return _loaded(one)
    names = list(dict.fromkeys([*groups, *(i.group for i in known), *(i.name for i in known)]))
    near = difflib.get_close_matches(one, names, n=3, cutoff=0.5)
    hint = f"the nearest are {', '.join(near)}" if near else f"groups are {', '.join(groups)}"
    raise InputError(
        f"Index {one!r} is unknown; {hint}.  One of your own is {WAYS}, or an Index object in "
        "Python."
    )


def _loaded(text: str) -> Iterator[Index]:
    place = load(text, "Index", WAYS)
    if not place.name:
        given = tuple(x for x in vars(place.module).values() if isinstance(x, Index))
        if not given:
            raise InputError(f"File {text} holds no Index; define one, or name a tuple of them.")
    elif not hasattr(place.module, place.name):
        known = [n for n, x in vars(place.module).items() if isinstance(x, Index)]
        raise absent(text, "Index", place.name, known)
    else:
        given = getattr(place.module, place.name)
    several = (given,) if isinstance(given, Index) else given
    if not isinstance(several, tuple) or not all(isinstance(i, Index) for i in several):
        raise InputError(
            f"Index {text!r} must be an Index or a tuple of them, but is {type(given).__name__}."
        )
    return iter(several)
