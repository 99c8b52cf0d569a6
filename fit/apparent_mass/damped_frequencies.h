#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/run/run.h"

namespace unrig {

/// At which frequencies does this free decay ring, and how fast does each die away?
struct DecayProblem {
  Eigen::MatrixXd signal;       ///< samples x channels; NaN: missing. Channels share the poles, each has its own amplitudes, phases and offset.
  double dt = 0;                ///< s
  Eigen::Index most_poles = 12; ///< more are not looked for
};

/// One vibration of the decay: a pole -decay +- i 2 pi frequency. Errors are one standard deviation.
struct DampedMode {
  double frequency = 0, frequency_error = 0;          ///< Hz, damped, between 0 and the Nyquist frequency (folded into it where it was higher)
  double decay = 0, decay_error = 0;                  ///< 1/s
  double natural_frequency = 0, natural_error = 0;    ///< Hz: |pole| / 2 pi = frequency / sqrt(1 - zeta^2)
  double damping_ratio = 0, damping_ratio_error = 0;  ///< zeta = decay / |pole|
  Eigen::VectorXd amplitude;                          ///< per channel at the first sample, in the channel's unit
  double significance = 0;                            ///< chi-square by which the vibration stands above the noise
  int poles = 1;  ///< more than one: the decay is not exponential (friction, drag, a stiffness that changes with amplitude); see `damped_frequencies`
};

struct DampedFrequencies {
  std::vector<DampedMode> modes;  ///< ascending in frequency
  Eigen::VectorXd noise;          ///< per channel: standard deviation of the white part, from differences (core/run/motion.h)
  Eigen::VectorXd residual;       ///< per channel: r.m.s. of what the modes leave
  Eigen::MatrixXd remainder;      ///< samples x channels: what the modes leave, 0 where missing
  bool complete = true;           ///< false: `most_poles` were taken and there is more in the record
};

/// Damped frequencies and decay rates of a free decay, far better than a line of its spectrum.
///
/// Poles are taken up one by one, at the highest peak of the spectra of what is left, seen through exponential windows of several lengths (a matched
/// filter: a mode that dies at once stands out only in a short window). After each, all poles are fitted together by least squares in the
/// time domain with amplitudes and offsets eliminated (DecayModel), which for white noise is maximum likelihood and reaches the Cramer-Rao
/// bound. A pole is kept where it lowers chi-square by more than noise would in one record of a thousand; the noise is that of the record's own
/// differences, or, where the spectrum is coloured, its running median around the peak.
///
/// Standard errors: from the Gauss-Newton Hessian and the residual's own r.m.s.; enlarged where the residual's spectrum is higher around a mode
/// than on average (sandwich formula with the smoothed periodogram of the residual).
///
/// Poles closer together than the sum of their decay rates (in rad/s), or of which one grows, describe one vibration whose decay is not exponential,
/// and are reported as one mode: with the mean decay, and the frequency to which it tends as it dies (a straight line through the momentary
/// frequency over the amplitude squared, weighted by power). The errors say how far both wander about that.
///
/// Throws std::invalid_argument for fewer than 32 samples or a `dt` that is not positive, NoAnswer where nothing stands above the noise.
DampedFrequencies damped_frequencies(const DecayProblem& problem);

/// The same of a run's channels, with the run named in messages. Throws InputError where a channel is missing or the run is too short.
DampedFrequencies damped_frequencies(const Run& run, const std::vector<std::string>& channels);

}  // namespace unrig
