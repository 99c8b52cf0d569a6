#pragma once
#include <Eigen/Core>
#include <vector>

namespace unrig {

/// Readings that say nothing of the rig, found before anything else looks at a channel.

/// Magnitude from which on a number is no reading. SCPI instruments send 9.9e37 for infinity and 9.91e37 for "not a number" (SCPI-99, volume 1, 7.2.1.4
/// and 7.2.1.5), netCDF fills with 9.97e36; no quantity of a rig has such a size in any unit.
constexpr double no_reading = 1e36;

/// What a channel's readings are.
enum class ReadingOf {
  answer,  ///< of the rig: gauge, sensors
  input    ///< what drives it: force, motion of the mount. It may be a blow that is over within a sample
};

/// Samples of one channel.
struct SuspectReadings {
  std::vector<Eigen::Index> isolated;  ///< ascending
  std::vector<Eigen::Index> blows;     ///< of an input that rests in most of the record: where it leaves its rest suddenly, which is no bad reading
};

/// Isolated bad readings: dropouts, spikes, numbers that stand for an error. x: samples in order, any unit, NaN where missing.
///
/// A sample's deviation d is its distance from the cubic through the two nearest samples on either side (at the ends through four on one), over the gain of their
/// noise. Suspect is a sample, or up to eight of one and the same value, or two that are outside of all others by half of the channel's range, that
///
///   - deviate by more than ten times the channel's scale: the median |d| / 0.6745, at least the rounding of its converter;
///   - deviate by more than ten times the median |d| / 0.6745 of the sixteen samples around, so that a fast vibration is not suspect;
///   - lie between neighbours that follow each other without them: |d| within five scales or a tenth of the suspect's, for three samples on either side. A signal with a sharp
///     beginning, or a pulse of several samples, is not suspect.
///
/// False alarms, in white noise: Gaussian 2e-23 a sample. Student's t with three degrees of freedom has one in 3000 that far out, which no estimate of a mean misses.
/// An input that rests in most of the record keeps what leaves its rest: it may be a blow. Answers keep what lies beside a blow (`beside`).
SuspectReadings isolated_readings(const Eigen::VectorXd& x, ReadingOf of, const std::vector<Eigen::Index>& beside = {});

/// Readings at the end of a converter's range: samples equal to the channel's largest (or smallest), where that cuts a signal off.
///
/// It does where it lasts for three samples or more and the signal heads beyond it on either side: the line through the samples there (a third as many, three at least) passes it in the
/// middle by two steps of the converter and six standard errors. The tangents of a parabola that turns within the last step of a coarse converter pass it by two steps at most. Error is that of the
/// steps, and of the noise where that is below four steps: in more of it three largest readings are not alike.
/// Or it lasts for twenty samples or more up to the end of the record, and a hundred others have more noise than a step.
std::vector<Eigen::Index> clipped_readings(const Eigen::VectorXd& x);

/// Largest less smallest of the medians over five samples: a range that single bad readings do not widen. 0 where there are no readings.
double robust_range(const Eigen::VectorXd& x);

}  // namespace unrig
