"""Figures of a study as researchers print them: PDF, PNG and the CSV of what is drawn.

    from martths_jax.figures import draw_figures
    draw_figures("study", "study/figures")

One module a family; this file only lists them.  Matplotlib is imported when a figure is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from martths_jax.errors import InputError
from martths_jax.figures import (
    histories,
    paired,
    plants,
    spread,
    storeys,
    structure,
    synchronisation,
)
from martths_jax.figures.source import ZOOM, Source, open_source
from martths_jax.figures.style import Drawing, house_style, save
from martths_jax.files import safe_name
from martths_jax.published import PAIR, PROPOSED
from martths_jax.study.summary import pairs

__all__ = ["Drawing", "Source", "draw_figures", "drawings", "figure_list", "open_source"]


#: Pictures of the structure, by the name of the problem.
FRAMES = {"marths": structure.frame, "uniaxial": storeys.frame}


def figure_list(source: Source) -> dict[str, Callable[[], Drawing]]:
    """What can be drawn from a study: file name -> function that draws it.

    Figures of the maRTHS paper carry its numbers; what needs a controller that the study has not
    run is left out, and a picture of the structure where nobody has drawn one.
    """
    found: dict[str, Callable[[], Drawing]] = {}
    numbers = {name: 8 + i for i, name in enumerate(ZOOM)}
    tails = {c: "" if c in PROPOSED else f"_{safe_name(c)}" for c in source.controllers}
    signals = (source.study.folder / "signals.nc").is_file()
    if signals:
        for motion in source.motions:
            number = numbers.get(motion.removesuffix("-like"))
            head = f"fig{number:02d}_" if number else ""
            found[f"{head}strokes_{safe_name(motion)}"] = partial(histories.strokes, source, motion)
        for controller in source.controllers:
            if source.coefficients(controller, source.motion) is not None:
                draw = partial(histories.coefficients, source, controller)
                found[f"fig11_coefficients{tails[controller]}"] = draw
        found["fig12_synchronisation_actuators"] = partial(synchronisation.actuators, source)
        found["fig13_synchronisation_interface"] = partial(synchronisation.interface, source)
    found["fig14a_controllers"] = partial(spread.controllers, source)
    for controller in source.controllers:
        found[f"fig14b_motions{tails[controller]}"] = partial(spread.motions, source, controller)
    found["fig15_histograms"] = partial(spread.histograms, source)
    for pair in pairs(source.study.dataset):
        tail = "" if pair == PAIR else f"_{'_'.join(map(safe_name, pair))}"
        found[f"paired{tail}"] = partial(paired.paired, source, pair)
    found["ecdf"] = partial(spread.ecdf, source)
    found["bode"] = partial(plants.bode, source)
    if signals:
        found["delay"] = partial(plants.delay, source)
    if source.problem.name in FRAMES:
        found["frame"] = partial(FRAMES[source.problem.name], source)
    return found


def drawings(source: Source, only: Sequence[str] = ()) -> Iterator[tuple[str, Drawing]]:
    """Draw figures one after the other, in the house style while the caller uses them.

    Args:
        only: beginnings of the names wanted, such as ``fig14``; all if empty.

    Raises:
        InputError: if one of `only` matches nothing.
    """
    known = figure_list(source)
    for wanted in only:
        if not any(name.startswith(wanted) for name in known):
            raise InputError(
                f"No figure's name begins with {wanted!r}; there are {', '.join(known)}."
            )
    for name, draw in known.items():
        if not only or name.startswith(tuple(only)):
            with house_style():
                yield name, draw()


def draw_figures(
    folder: Path | str,
    out: Path | str,
    *,
    trial: int = 0,
    motion: str | None = None,
    only: Sequence[str] = (),
    formats: Sequence[str] = ("pdf", "png"),
    dpi: int = 300,
    progress: Callable[[str], None] = lambda name: None,
) -> list[Path]:
    """Draw the figures of a study into a folder.

    Args:
        folder: of a finished study.
        out: where the files go, NAME.pdf, NAME.png and NAME.csv each.
        trial: whose histories are drawn; its signals must have been kept.
        motion: of the figures that show one motion.
        only: beginnings of the names wanted; all if empty.
        formats: what matplotlib can write.
        dpi: of the PNG files.
        progress: told the name of every figure written.

    Returns:
        paths of all files.

    Raises:
        InputError: no such study, trial, motion or figure, or files that cannot be written.
    """
    paths = []
    for name, drawing in drawings(open_source(folder, trial, motion), only):
        paths += save(drawing, Path(out), name, formats, dpi)
        progress(name)
    return paths
