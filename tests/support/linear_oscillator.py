#!/usr/bin/env python3
"""What linear models can reach on the oscillator recording: where the bounds of tests/fit/fit_test.cpp come from.

    python3 tests/support/linear_oscillator.py multisine.csv      # needs numpy and scipy; some seconds

Output-error models y_k = (b_0 u_k + ... + b_m u_{k-m}) / (1 + a_1 q^-1 + a_2 q^-2), with a free initial state and a free offset: the poles by
least squares, the rest of the unknowns, which are linear, eliminated at each step. And an impulse response of 400 free taps, the best that
any linear model of that memory can do. Nothing here knows of unrig.
"""
import sys

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.optimize import least_squares
from scipy.signal import lfilter


def output_error(u, y, taps):
    def residual(a):
        denominator = [1, a[0], a[1]]
        columns = [lfilter(np.eye(taps)[k], denominator, u) for k in range(taps)]
        columns += [lfilter([1], denominator, np.eye(1, len(u), k)[0]) for k in (0, 1)]  # initial state
        columns.append(np.ones(len(u)))
        x = np.array(columns).T
        return y - x @ np.linalg.lstsq(x, y, rcond=None)[0]

    w, zeta = 2 * np.pi * 68 * 0.0016384, 0.05
    r = np.exp(-zeta * w)
    return least_squares(residual, [-2 * r * np.cos(w), r * r], x_scale="jac").fun


def impulse_response(u, y, taps):
    x = np.c_[sliding_window_view(u, taps)[:, ::-1], np.ones(len(u) - taps + 1)]
    y = y[taps - 1:]
    return y - x @ np.linalg.lstsq(x, y, rcond=None)[0]


def main():
    lines = [line for line in open(sys.argv[1]) if not line.startswith("#")][1:]
    u, y = np.array([[float(cell) for cell in line.split(",")[1:]] for line in lines]).T
    for name, part in (("whole record", slice(None)), ("samples 12000 to 20000", slice(12000, 20000))):
        for taps in (2, 4, 8):
            print("%-24s two poles, %d coefficients: %.3f mV" % (name, taps, 1e3 * np.std(output_error(u[part], y[part], taps))))
    print("%-24s 400 taps: %.3f mV" % ("whole record", 1e3 * np.std(impulse_response(u, y, 400))))


if __name__ == "__main__":
    main()
