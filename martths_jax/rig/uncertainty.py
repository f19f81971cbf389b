"""Uncertain parameters: names, nominal values, spreads, distributions, and correlation.

A plant is drawn as p standard normal numbers, from which its parameters follow.  All draws zero
give the nominal values, whatever the distributions.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from scipy import linalg, special

from martths_jax.errors import argument_error, as_numbers

DISTRIBUTIONS = ("normal", "lognormal", "uniform")
#: How a spread is meant: as a share of the nominal value, or in the parameter's own unit.
KINDS = ("relative", "absolute")


@dataclass(frozen=True)
class Uncertainty:
    """Parameters that differ from plant to plant, any number p of them.

    One word for `units`, `kinds` or `distributions` counts for all parameters.

    Attributes:
        names: of the parameters.
        nominal: their nominal values; medians of all three distributions.
        sigmas: standard deviations [-] or in the parameter's unit, see `kinds`.
        units: of the parameters, for tables and figures.
        kinds: ``relative`` (sigma is a share of the nominal value) or ``absolute``.
        distributions: ``normal``, ``lognormal`` (nominal value times exp(s z)) or ``uniform``
            (within sqrt(3) standard deviations of the nominal value).
        correlation: (p, p) of the standard normals behind the parameters, which is that of the
            parameters themselves (but for their nominal values' signs, if sigmas are relative)
            where both are normal; None where they are independent.

    Raises:
        InputError: for numbers or words that cannot be used.
    """

    names: tuple[str, ...] = ()
    nominal: tuple[float, ...] = ()
    sigmas: tuple[float, ...] = ()
    units: tuple[str, ...] = "1"
    kinds: tuple[str, ...] = "relative"
    distributions: tuple[str, ...] = "normal"
    correlation: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self):
        names = tuple(self.names)
        if not all(isinstance(name, str) and name for name in names):
            raise argument_error("names", "be names", repr(names)[:80])
        if len(set(names)) != len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise argument_error("names", "name every parameter once", f"{twice!r} twice")
        settle = lambda name, value: object.__setattr__(self, name, value)  # noqa: E731
        settle("names", names)
        settle("nominal", _numbers("nominal", self.nominal, names))
        settle("sigmas", _numbers("sigmas", self.sigmas, names, least=0.0))
        settle("units", _words("units", self.units, names))
        settle("kinds", _words("kinds", self.kinds, names, KINDS))
        settle("distributions", _words("distributions", self.distributions, names, DISTRIBUTIONS))
        settle("correlation", _checked_correlation(self.correlation, names))
        for name, value, kind, distribution in zip(
            names, self.nominal, self.kinds, self.distributions, strict=True
        ):
            if value == 0 and (kind == "relative" or distribution == "lognormal"):
                raise argument_error(
                    "nominal", f"be other than zero for the {kind} spread of a {distribution} "
                    "parameter", f"0 for {name}", 'Use kinds "absolute" and "normal" or "uniform".',
                )  # fmt: skip

    def __len__(self) -> int:
        return len(self.names)

    def values(self, draws: jax.Array, spread=1.0, about: jax.Array | None = None) -> jax.Array:
        """Parameters that belong to standard normal draws z; differentiable in all arguments.

            normal     x = m + sigma z,
            lognormal  x = m exp(s z),  exp(s^2) (exp(s^2) - 1) = (sigma / m)^2,
            uniform    x = m + sqrt(3) sigma erf(z / sqrt(2)),

        where z, if the parameters are correlated, is L z of independent draws, L L' = correlation
        (a Gaussian copula), so that every parameter's own distribution is exact.

        Args:
            draws: (T, p) independent standard normal numbers.
            spread: factor on all standard deviations [-].
            about: (T, p) or (1, p) values m instead of the nominal ones.

        Returns:
            (T, p) parameters.
        """
        if not self.names:
            return draws
        z = [draws[:, i] for i in range(len(self))]
        if self.correlation is not None:
            L = np.linalg.cholesky(np.array(self.correlation))
            z = [sum(L[i, j] * z[j] for j in range(i + 1)) for i in range(len(z))]
        centre = self.nominal if about is None else [about[:, i] for i in range(len(self))]
        columns = [
            _parameter(self.distributions[i], self.kinds[i], centre[i], self.sigmas[i] * spread, zi)
            for i, zi in enumerate(z)
        ]
        return jnp.stack(columns, axis=1)

    def draws(self, values, spread: float = 1.0) -> np.ndarray:
        """Standard normal draws that give parameters, the inverse of ``values`` (host).

        Args:
            values: (T, p) or (p,) parameters.
            spread: factor on all standard deviations [-].

        Returns:
            (T, p) draws, zero where nothing varies.

        Raises:
            InputError: for a wrong shape, or a value that no draw gives.
        """
        values = np.atleast_2d(as_numbers(values))
        if values.ndim != 2 or values.shape[1] != len(self):
            raise argument_error(
                "values", f"have shape (trials, {len(self)})", f"shape {values.shape}"
            )
        if not self.names:
            return values
        columns = []
        for i, name in enumerate(self.names):
            one = (self.distributions[i], self.kinds[i], self.nominal[i], self.sigmas[i] * spread)
            with np.errstate(all="ignore"):
                z = _draw(*one, values[:, i])
            if not np.all(np.isfinite(z)):
                row = int(np.argmin(np.isfinite(z)))
                raise argument_error(
                    "values", f"be within the {self.distributions[i]} distribution of {name}",
                    f"{values[row, i]:g} in row {row}",
                )  # fmt: skip
            columns.append(z)
        z = np.stack(columns, axis=1)
        if self.correlation is None:
            return z
        L = np.linalg.cholesky(np.array(self.correlation))
        return linalg.solve_triangular(L, z.T, lower=True).T

    def column(self, values: jax.Array, name: str) -> jax.Array:
        """(T,) values of one parameter out of (T, p).

        Raises:
            InputError: for a name that is not among the parameters.
        """
        if name not in self.names:
            raise argument_error("name", f"be one of {', '.join(self.names)}", repr(name)[:80])
        return values[:, self.names.index(name)]


def _parameter(distribution: str, kind: str, m, sigma, z):
    """(T,) values of one parameter; `sigma` as its `kind` says, z (T,)."""
    if distribution == "lognormal":
        share = sigma if kind == "relative" else sigma / abs(m)
        return m * jnp.exp(_log_sigma(share) * z)
    if distribution == "uniform":
        z = np.sqrt(3) * jax.scipy.special.erf(z * np.sqrt(0.5))
    return m * (1 + sigma * z) if kind == "relative" else m + sigma * z


def _draw(distribution: str, kind: str, m: float, sigma: float, x: np.ndarray) -> np.ndarray:
    """(T,) draws of one parameter, the inverse of ``_parameter``; not finite where none fits."""
    if sigma == 0:
        return np.where(np.isclose(x, m, rtol=1e-12, atol=0), 0.0, np.inf)
    if distribution == "lognormal":
        share = sigma if kind == "relative" else sigma / abs(m)
        return np.log(x / m) / float(_log_sigma(share))
    z = (x / m - 1) / sigma if kind == "relative" else (x - m) / sigma
    return np.sqrt(2) * special.erfinv(z / np.sqrt(3)) if distribution == "uniform" else z


def _log_sigma(share):
    """s of a lognormal number whose standard deviation is `share` of its median.

    The quotient below is written out near zero, where a spread of zero has a derivative too.
    """
    square = share * share
    small = square < 1e-8
    safe = jnp.where(small, 1.0, square)
    exact = jnp.sqrt(jnp.log1p(2 * safe / (1 + jnp.sqrt(1 + 4 * safe))) / safe)
    return share * jnp.where(small, 1 - 0.75 * square, exact)


def _numbers(name: str, given, names, least: float = -np.inf) -> tuple[float, ...]:
    """`given` as one finite number a parameter, not below `least`."""
    values = as_numbers(given)
    if values.shape != (len(names),):
        raise argument_error(name, f"be {len(names)} numbers, one a parameter", repr(given)[:80])
    for parameter, value in zip(names, values, strict=True):
        if not (np.isfinite(value) and value >= least):
            wanted = "be finite" if least == -np.inf else f"be finite and at least {least:g}"
            raise argument_error(name, wanted, f"{value:g} for {parameter}")
    return tuple(values.tolist())


def _words(name: str, given, names, known: tuple[str, ...] | None = None) -> tuple[str, ...]:
    """`given` as one word a parameter, out of `known`."""
    words = (given,) * len(names) if isinstance(given, str) else tuple(given)
    if len(words) != len(names):
        wanted = f"be one word for all parameters or {len(names)} words"
        raise argument_error(name, wanted, repr(given)[:80])
    for parameter, word in zip(names, words, strict=True):
        if not isinstance(word, str) or (known and word not in known):
            wanted = f"be one of {', '.join(known)}" if known else "be words"
            raise argument_error(name, wanted, f"{word!r} for {parameter}")
    return words


def _checked_correlation(given, names) -> tuple[tuple[float, ...], ...] | None:
    """A correlation matrix as tuples; None where it is not given."""
    if given is None:
        return None
    R, p = as_numbers(given), len(names)
    if R.shape != (p, p) or not np.all(np.isfinite(R)):
        got = f"shape {R.shape}" if R.shape != (p, p) else "a number that is not finite"
        raise argument_error("correlation", f"be {p} x {p} finite numbers", got)
    if np.any(np.abs(np.diag(R) - 1) > 1e-12):
        i = int(np.argmax(np.abs(np.diag(R) - 1)))
        raise argument_error(
            "correlation", "have ones on its diagonal", f"{R[i, i]:g} for {names[i]}"
        )
    if np.any(np.abs(R - R.T) > 1e-12):
        i, j = np.unravel_index(np.argmax(np.abs(R - R.T)), R.shape)
        got = f"{R[i, j]:g} and {R[j, i]:g} for {names[i]} and {names[j]}"
        raise argument_error("correlation", "be symmetric", got)
    least = float(np.linalg.eigvalsh(R)[0])
    if not least > 1e-12:
        remedy = "Take out parameters that follow from others, or make correlations smaller."
        got = f"{least:.3g} for its least eigenvalue"
        raise argument_error("correlation", "be positive definite", got, remedy)
    return tuple(map(tuple, R.tolist()))
