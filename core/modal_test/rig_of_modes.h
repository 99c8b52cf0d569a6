#pragma once
#include <string>
#include <vector>

#include "core/modal_test/modal_fit.h"

namespace unrig {

/// A rig known as modes, out of frequency response functions.
struct RigOfModes {
  std::string text;                   ///< of the rig file
  std::string report;                 ///< for people: the modes with their errors, and what is left of each function
  std::vector<std::string> warnings;
};

/// The rig file of a fit. With r_jk the residues, and d the motion where the force acts (of a universal file by its nodes, else the first motion):
///
///   mass m_k = 1 / r_dk,   sensor_shape s_jk = r_jk m_k,   gauge_gain = r_gk m_k
///
/// and one standard deviation of each but the shapes, from the joint covariance. Without such a motion m_k is 1 kg: the scale of a mode is then free, and gauge and force do not see it.
/// `command`: what the file's first line says. Throws InputError for more than one gauge, and where a mass comes out negative.
RigOfModes rig_of_modes(const std::vector<FrequencyResponse>& functions, const ModalFit& fit, const std::string& command);

}  // namespace unrig
