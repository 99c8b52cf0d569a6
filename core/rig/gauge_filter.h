#pragma once
#include <Eigen/Core>

#include "core/numerics/dual_matrix.h"
#include "core/files/error.h"

namespace unrig {

struct LinearSystem;

/// What lies between the bridge and the recorded gauge column: z' = F z + g y, reading = h z + direct y, y the moment at the bridge. Partials belong to
/// the filter's own parameters, which stand in theta from `first` on, of `parameters` in all; a filter that is known has none.
struct GaugeFilter {
  DualMatrix F, g;
  Eigen::RowVectorXd h;
  double direct = 0;

  Eigen::Index states() const { return F.rows(); }
};

/// Where the parameters of a filter stand in theta; as it is: nowhere, the filter is known.
struct FilterParameters {
  Eigen::Index first = -1, count = 0;
};

/// Low-pass of first order, w / (s + w), or of second, w^2 / (s^2 + 2 zeta w s + w^2), w = 2 pi `cutoff` [Hz]; zeta = 1/sqrt(2) is Butterworth's (S. Butterworth,
/// Wireless Engineer 7 (1930) 536). Parameters: cutoff, zeta.
GaugeFilter first_order_low_pass(double cutoff);
GaugeFilter low_pass(double cutoff, double damping_ratio, FilterParameters parameters = {});

/// A delay by `time` [s], as the all-pass of this order that agrees with exp(-time s) to the order 2 order + 1 (G. A. Baker and P. Graves-Morris, Pade Approximants (1996),
/// section 1.2). Its phase is off by 1e-3 rad where 2 pi f time = 1.6 (order 3) or 5.9 (order 6). Parameter: the time.
GaugeFilter delay(double time, int order, FilterParameters parameters = {});

/// The filter nearest to a measured frequency response (Hz, complex, relative to that at frequency 0), with the fewest poles that miss it by less than 1e-3, or else the best of up
/// to eight: least squares of (N(s) - H D(s)) / D_before(s), repeated (C. K. Sanathanan and J. Koerner, IEEE Trans. Autom. Control 8 (1963) 56). `miss`: largest
/// distance that is left at a measured frequency. N(0) = D(0): the dead weights of the calibration hung behind the same amplifier.
/// Throws std::invalid_argument where no stable filter is found.
GaugeFilter measured_filter(const Eigen::VectorXd& frequency, const Eigen::VectorXcd& response, double& miss);

/// Puts the filter behind output `row` of `system`. It is at rest where the rig is, and in an unknown state where the run starts anyhow.
void append_gauge_filter(LinearSystem& system, Eigen::Index row, const GaugeFilter& filter);

}  // namespace unrig
