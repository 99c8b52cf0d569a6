#!/usr/bin/env python3
"""Best approximations of Wagner's function by decaying exponentials: where the constants of core/model/wagner.cpp come from.

    python3 tests/support/fit_wagner.py          # needs numpy and scipy; about 10 s

prints the largest error over all s >= 0 of the best sum of 1, 2, ... 13 exponentials, and the two tables of constants as C++.
Nothing is random: the same library versions give the same digits.

What is solved. Wagner's function (seed, Eq. 2.4) is phi(s) = 1 - f(s), f(s) = Int_0^inf w(x) exp(-x s) dx with w > 0. Sought are amplitudes
A_j and rates b_j that make the largest |e(s)|, e(s) = f(s) - sum_j A_j exp(-b_j s), over all s >= 0 as small as n terms allow. The difference of
two sums of n exponentials has at most 2n - 1 zeros, so a sum whose error has 2n + 1 extremes of alternating sign cannot be bettered, by any n
real rates, below the smallest of those extremes; where all extremes are equal it is the best (D. Braess, Nonlinear Approximation Theory, 1986,
ch. VI; W. Hackbusch, Comput. Visual. Sci. 20 (2019) 1-11, for f = 1/s). The printed gap between the largest and the smallest extreme is
therefore a proof of how near the best the result is.

How. Least squares on a logarithmic grid of s gives a sum whose error has the 2n + 1 extremes, of unequal size. From there the sizes are led to
a common value in steps: unknown are the logarithms of A_j and b_j (so both stay positive) and of the common size E; each step is solved by
Newton's method, in which the places of the extremes need no derivative, for e' = 0 there.
"""
import numpy as np
from scipy.optimize import least_squares
from scipy.special import i0, i1, k0, k1

POLES = {"within_1e4": 6, "within_1e6": 13}

# f(s) by the trapezoidal rule in ln x, as in core/model/wagner.cpp.
STEP = 0.18
NODE = np.exp(STEP * np.arange(-190, 17))
WEIGHT = STEP / (NODE * ((k0(NODE) - k1(NODE)) ** 2 + np.pi**2 * (i0(NODE) + i1(NODE)) ** 2))


def deficit(s):
    """f(s) = 1 - phi(s)."""
    return np.exp(-np.outer(s, NODE)) @ WEIGHT


# Beyond s = 1e8 both f and the sum are below 2e-8 and fall, and the error stays below that; between 0 and 1e-5 it changes by less than 0.1 %.
GRID = np.concatenate([[0.0], np.logspace(-5, 8, 8000)])
DEFICIT = deficit(GRID)


def terms(logs, s):
    """A_j exp(-b_j s), one column per term; logs = (ln A, ln b)."""
    amplitude, rate = np.exp(np.split(logs, 2))
    return amplitude * np.exp(-np.outer(s, rate))


def error(logs, s, f):
    return f - terms(logs, s).sum(axis=1)


def slope(logs, s):
    """de/dlogs."""
    x = terms(logs, s)
    return np.hstack([-x, x * np.outer(s, np.exp(np.split(logs, 2)[1]))])


def extremes(logs):
    """Place and value of the extreme of e between each two of its zeros, the place by a parabola through three points in ln s."""
    e = error(logs, GRID, DEFICIT)
    pieces = np.split(np.arange(len(GRID)), np.flatnonzero(np.diff(np.sign(e))) + 1)
    place = []
    for piece in pieces:
        i = piece[np.argmax(abs(e[piece]))]
        if 1 < i < len(GRID) - 1:
            left, mid, right = e[i - 1 : i + 2]
            place.append(GRID[i] * (GRID[3] / GRID[2]) ** ((left - right) / (left - 2 * mid + right) / 2))
        else:
            place.append(GRID[i])
    place = np.array(place)
    return place, error(logs, place, deficit(place))


def levelled(logs, log_size, offset):
    """Solves ln|extreme_i| = log_size + offset_i; None where Newton's method does not settle."""
    for iteration in range(12):
        place, value = extremes(logs)
        if len(place) != len(offset):
            return None
        miss = np.log(abs(value)) - log_size - offset
        if abs(miss).max() < 1e-9:
            return logs, log_size, iteration
        matrix = np.hstack([slope(logs, place) / value[:, None], -np.ones((len(place), 1))])
        change = np.linalg.solve(matrix, -miss)
        if abs(change[:-1]).max() > 0.5:
            return None
        logs, log_size = logs + change[:-1], log_size + change[-1]
    return None


def equalised(logs):
    """Leads the sizes of the extremes to a common value."""
    _, value = extremes(logs)
    assert len(value) == len(logs) + 1, "the start has %d extremes, %d are needed" % (len(value), len(logs) + 1)
    log_size = np.log(abs(value)).mean()
    offset = np.log(abs(value)) - log_size
    left, step = 1.0, 0.1
    while left > 0:
        goal = max(0.0, left - step)
        solved = levelled(logs, log_size, offset * goal)
        if solved is None:
            step /= 2
            assert step > 1e-6, "the extremes do not level"
            continue
        logs, log_size, iterations = solved
        left = goal
        if iterations <= 4:
            step *= 1.6
    return logs


def best(n, fewer):
    """The best sum of n exponentials, started from the best of n - 1 (logs, or None)."""
    if fewer is None:
        start = np.log([0.45, 0.15])
    else:
        amplitude, rate = np.split(fewer, 2)
        place = np.linspace(0, n - 2, n)
        rate = np.interp(place, np.arange(n - 1), rate) + np.linspace(-1, 0.3, n)
        amplitude = np.interp(place, np.arange(n - 1), amplitude) - 0.3
        amplitude[0] -= 1
        start = np.concatenate([amplitude, rate])
    some = np.concatenate([[0], np.flatnonzero((GRID > 1e-2) & (GRID < 1e7))[::6]])
    fit = least_squares(
        lambda p: 1e3 * error(p, GRID[some], DEFICIT[some]), start, jac=lambda p: 1e3 * slope(p, GRID[some]),
        x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=3000)
    amplitude, rate = np.split(equalised(fit.x), 2)
    order = np.argsort(rate)
    return np.concatenate([amplitude[order], rate[order]])


def main():
    found = {}
    logs = None
    print("poles  largest error  gap to the smallest extreme  phi(0) - 1/2")
    for n in range(1, max(POLES.values()) + 1):
        logs = best(n, logs)
        value = extremes(logs)[1]
        size = abs(value).max()
        print("%5d  %.6e   %.1e                      %+.3e" % (n, size, 1 - abs(value).min() / size, value[0]))
        found[n] = logs
    for name, n in POLES.items():
        amplitude, rate = np.exp(np.split(found[n], 2))
        print("\nconstexpr Pole %s_poles[] = {" % name)
        for a, b in zip(amplitude, rate):
            print("    {%.14e, %.14e}," % (a, b))
        print("};")


if __name__ == "__main__":
    main()
