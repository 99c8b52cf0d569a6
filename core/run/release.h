#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>

namespace unrig {

struct Hold;
struct Run;

/// Where a held rig is let go.
struct Release {
  double instant = 0;      ///< samples from the first, between two of them
  Eigen::Index first = 0;  ///< first sample that is behind it with all but certainty
};

/// The release of a free decay that begins with a hold; none where the readings x (any unit, NaN where missing) move from the first sample on, or never.
///
/// A change point of a regression at an unknown instant (Quandt 1958), by a ratio of likelihoods. Held against each other are, over windows from twelve samples of rest to where readings stand out of
/// the first k by 10 to 320 of their standard deviations,
///
///   - the hold: x = c up to the release t_r, and x = c + sum_j b_j (t - t_r)^j, j = 2 to 4, from there on: value and rate go on, as inertia has it;
///   - a decay that began before: a polynomial of fourth degree, which has as many unknowns and follows the turning point of any vibration for a third of its period.
///
/// The ratio of sums of squares is that of a change with four degrees of freedom. A release is found where chance exceeds it once in 1000 records, all windows and instants counted (Bonferroni). The noise is
/// that of the hold itself, so that its colour, a hum and rounding count as they are. Beside a polynomial of sixth degree, for decays of several modes, chance must be below 1/1000 as well. Refused at that level
/// is a hold that a smooth curve describes better than a constant, and a window that the first formula does not follow: variance ratios by Paulson's (1942) normal approximation.
///
/// A release from rest sets out like t^2, A (w t)^2/2 of an amplitude A: it hides in noise sigma for sqrt(2 sigma/A)/w. `instant` is the likeliest one. `first` is the last that any window allows, where chi-square
/// has risen by 10.83, over the colour of the hold and with j = 1 to 3 as well (overdamped). A decay loses little by samples after its release, while one sample before would not be of it.
///
/// The hold's level is not used further. It is the static deflection, and with the load that held the rig it would give the stiffness, but that load is no column; the decay's start, which is estimated freely,
/// loses only what the level adds to one reading of thousands. A hand that trembles is no constant: such a hold is not found, nor is one shorter than twelve samples or than the departure from it.
///
/// Sources: R. E. Quandt, J. Am. Stat. Assoc. 53 (1958) 873; E. Paulson, Ann. Math. Stat. 13 (1942) 233.
std::optional<Release> release_of(const Eigen::VectorXd& x);

/// Lets a pluck that begins with a hold begin behind its release: earlier samples are dropped from all columns, `start` is the time of the first that is left, `hold` says what was done. Times stay the record's.
///
/// The gauge decides. Where there is none, every column that is neither angle, weight nor input must show a release, and the last counts. Samples of weight 0 have no say.
void begin_at_release(Run& run);

/// "released at 0.5013 s, 251 samples of hold before left out"
std::string said_of(const Hold& hold);

}  // namespace unrig
