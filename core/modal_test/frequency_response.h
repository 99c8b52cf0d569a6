#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/files/error.h"

namespace unrig {

/// What a frequency response function answers with, per newton.
enum class Measured { gauge, displacement, velocity, acceleration };
std::string to_string(Measured response);

/// A frequency response function H(f) = response / force, in SI, of an impact or shaker test.
struct FrequencyResponse {
  InputError::Place place;     ///< of its file
  std::string name;            ///< a column for it in run files: the file's name, or "3_Z" of node 3
  Measured response = Measured::gauge;
  std::string unit;            ///< SI unit of the response
  bool has_nodes = false;      ///< the file says where response and force are
  bool driving_point = false;  ///< and they are in one place and direction
  Eigen::VectorXd frequency;   ///< Hz, increasing, above 0
  Eigen::VectorXcd value;
  Eigen::VectorXd coherence;   ///< gamma^2, 0 to 1; empty where it was not measured
};

/// Frequency response functions out of a universal file (datasets 58 of the type 4, coherence of the type 6 by response and reference), or the one of a table:
///
///     frequency [Hz],real [m/s^2/N],imaginary [m/s^2/N],coherence
///     frequency [Hz],magnitude [m/s^2/N],phase [deg],coherence
///
/// The unit says what the response is: m/N, m/s/N and m/s^2/N are motions, anything else over a force is a gauge. Lines at 0 Hz and without a number are left out.
/// Throws InputError (file, line, found, wanted) for what is neither, units that are no response per force, fewer than 16 lines, frequencies that do not increase, a coherence outside 0 to 1.
std::vector<FrequencyResponse> read_frequency_responses(const std::string& path);

}  // namespace unrig
