#include "core/propagate/response.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/run/motion.h"
#include "tests/support/random_matrix.h"
#include "tests/support/slope.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::random_matrix;

constexpr Index states = 7, channels = 2, inputs = 2;
constexpr double dt = 0.05;

/// A stable system whose A, B, C and D move with theta_0, its B and D alone with theta_1; theta_2 does nothing. Motion in the last three states.
LinearSystem system_at(const VectorXd& theta) {
  LinearSystem s;
  const auto top = [](MatrixXd m) {
    MatrixXd full = MatrixXd::Zero(states, m.cols());
    full.topRows(states - 3) = m;
    return full;
  };
  MatrixXd a = top(random_matrix(states - 3, states, 1));
  a.topLeftCorner(states - 3, states - 3) -= 3 * MatrixXd::Identity(states - 3, states - 3);
  const MatrixXd da = top(random_matrix(states - 3, states, 2)), db = top(random_matrix(states - 3, inputs, 4));
  a(4, 5) = a(5, 6) = 1;
  s.A = DualMatrix(a + theta[0] * da, 3);
  s.A.add_partial(0, da);
  s.B = DualMatrix(top(random_matrix(states - 3, inputs, 3)) + (theta[0] + 2 * theta[1]) * db, 3);
  s.B.add_partial(0, db);
  s.B.add_partial(1, 2 * db);
  const MatrixXd dc = random_matrix(channels, states, 6), dd = random_matrix(channels, inputs, 8);
  s.C = DualMatrix(random_matrix(channels, states, 5) + theta[0] * dc, 3);
  s.C.add_partial(0, dc);
  s.D = DualMatrix(random_matrix(channels, inputs, 7) + (theta[0] - theta[1]) * dd, 3);
  s.D.add_partial(0, dd);
  s.D.add_partial(1, -dd);
  s.coordinates = 1;
  s.lags = 2;
  s.motion = 4;
  return s;
}

/// A start that moves with theta_0 too.
DualMatrix start_at(const VectorXd& theta) {
  DualMatrix start(random_matrix(states, 1, 9) + theta[0] * random_matrix(states, 1, 10), 3);
  start.add_partial(0, random_matrix(states, 1, 10));
  return start;
}

const VectorXd at = (VectorXd(3) << 0.1, 0.2, 0.3).finished();
const LinearSystem here = system_at(at);
const ExactStep step_here = exact_step(here, dt);

constexpr double round_off = 1e-12;  // some hundred products of numbers of order one, one after the other

TEST(Coast, IsDriveWithoutAnythingThatDrives) {
  for (const Index samples : {1, 31, 32, 33, 100}) {  // outputs come in blocks of 32
    const Response coasting = coast(here, step_here, start_at(at), samples, Partials::all);
    const Response driven = drive(here, step_here, start_at(at), samples, VectorXd::Zero(samples), {}, Partials::all);
    EXPECT_LT((coasting.output - driven.output).norm(), round_off * driven.output.norm()) << samples;
    EXPECT_LT((coasting.end.value - driven.end.value).norm(), round_off * driven.end.value.norm()) << samples;
    EXPECT_LT((coasting.partial[0] - driven.partial[0]).norm(), round_off * driven.partial[0].norm()) << samples;
    EXPECT_LT((coasting.end.d(0) - driven.end.d(0)).norm(), round_off * driven.end.d(0).norm()) << samples;
  }
}

TEST(Coast, InTwoPiecesIsTheWhole) {
  const Response whole = coast(here, step_here, start_at(at), 90, Partials::all);
  const Response first = coast(here, step_here, start_at(at), 50, Partials::all);
  const Response second = coast(here, step_here, first.end, 40, Partials::all);
  EXPECT_LT((second.output - whole.output.bottomRows(40)).norm(), round_off * whole.output.norm());
  EXPECT_LT((second.partial[0] - whole.partial[0].bottomRows(40)).norm(), round_off * whole.partial[0].norm());
  EXPECT_LT((second.end.d(0) - whole.end.d(0)).norm(), round_off * whole.end.d(0).norm());
}

TEST(Coast, IsLinearInItsStart) {
  const DualMatrix a(random_matrix(states, 1, 20)), b(random_matrix(states, 1, 21));
  const MatrixXd of_a = coast(here, step_here, a, 64, Partials::none).output, of_b = coast(here, step_here, b, 64, Partials::none).output;
  const MatrixXd of_both = coast(here, step_here, 2.0 * a - b, 64, Partials::none).output;
  EXPECT_LT((of_both - (2 * of_a - of_b)).norm(), round_off * of_a.norm());
}

TEST(Coast, WithoutPartialsIsTheSame) {
  const Response with = coast(here, step_here, start_at(at), 70, Partials::all), without = coast(here, step_here, start_at(at), 70, Partials::none);
  EXPECT_EQ(with.output, without.output);
  EXPECT_TRUE(without.partial.empty());
}

TEST(Coast, CarriesItsSlopes) {
  const Response r = coast(here, step_here, start_at(at), 40, Partials::all);
  const auto moved = [&](double h) {
    const VectorXd theta = at + h * VectorXd::Unit(3, 0);
    const LinearSystem s = system_at(theta);
    return coast(s, exact_step(s, dt), start_at(theta), 40, Partials::none);
  };
  EXPECT_TRUE(test::is_slope([&](double h) { return moved(h).output; }, r.partial[0], 1e-3));
  EXPECT_TRUE(test::is_slope([&](double h) { return moved(h).end.value; }, r.end.d(0), 1e-3));
}

TEST(Drive, CarriesItsSlopes) {
  constexpr Index samples = 40;
  const VectorXd jerk = random_matrix(samples, 1, 30);
  const MatrixXd input = random_matrix(samples + 1, inputs, 31);
  const Response r = drive(here, step_here, start_at(at), samples, jerk, input, Partials::all);
  for (Index j = 0; j < 2; ++j) {
    const auto moved = [&](double h) {
      const VectorXd theta = at + h * VectorXd::Unit(3, j);
      const LinearSystem s = system_at(theta);
      return drive(s, exact_step(s, dt), start_at(theta), samples, jerk, input, Partials::none);
    };
    ASSERT_EQ(r.partial[static_cast<std::size_t>(j)].rows(), samples) << "parameter " << j;
    EXPECT_TRUE(test::is_slope([&](double h) { return moved(h).output; }, r.partial[static_cast<std::size_t>(j)], 1e-3)) << "parameter " << j;
    EXPECT_TRUE(test::is_slope([&](double h) { return moved(h).end.value; }, r.end.d(j), 1e-3)) << "parameter " << j;
  }
  EXPECT_EQ(r.partial[2].size(), 0);
}

TEST(Drive, IsTheSumOfWhatItsCausesDo) {
  constexpr Index samples = 50;
  const VectorXd jerk = random_matrix(samples, 1, 40);
  const MatrixXd input = random_matrix(samples + 1, inputs, 41);
  const DualMatrix rest(MatrixXd::Zero(states, 1)), start(random_matrix(states, 1, 42));
  const MatrixXd all = drive(here, step_here, start, samples, jerk, input, Partials::none).output;
  const MatrixXd sum = drive(here, step_here, start, samples, {}, {}, Partials::none).output +
                       drive(here, step_here, rest, samples, jerk, {}, Partials::none).output +
                       drive(here, step_here, rest, samples, {}, input, Partials::none).output;
  EXPECT_LT((all - sum).norm(), round_off * all.norm());
}

TEST(Drive, RefusesInputsThatTheSystemDoesNotHave) {
  const DualMatrix rest(MatrixXd::Zero(states, 1));
  EXPECT_THROW(drive(here, step_here, rest, 5, {}, MatrixXd::Zero(6, inputs - 1), Partials::none), std::invalid_argument);
  EXPECT_THROW(drive(here, step_here, rest, 5, {}, MatrixXd::Zero(6, inputs + 1), Partials::none), std::invalid_argument);
}

TEST(FreeResponseRows, TimesAStateAreItsFreeResponse) {
  const DualMatrix start(random_matrix(states, 1, 50));
  const MatrixXd output = coast(here, step_here, start, 75, Partials::none).output;
  const std::vector<MatrixXd> rows = free_response_rows(here, step_here, 75);
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(channels));
  for (Index c = 0; c < channels; ++c)
    EXPECT_LT((rows[static_cast<std::size_t>(c)] * start.value - output.col(c)).norm(), round_off * output.norm()) << c;
}

TEST(SplineStates, FollowOneSplineOfTheMotion) {
  constexpr Index samples = 30;
  const MatrixXd states_of_spline = spline_states(step_here, samples);
  const Motion motion = motion_of(VectorXd::Unit(samples, 0), dt);
  LinearSystem open = here;
  open.C = DualMatrix(MatrixXd::Identity(states, states));
  const MatrixXd expected = drive(open, step_here, DualMatrix(MatrixXd::Zero(states, 1)), samples, motion.jerk, {}, Partials::none).output;
  EXPECT_LT((states_of_spline.transpose() - expected).norm(), round_off * expected.norm());
  // After its four steps the spline is over: the shaft stands where it stood.
  EXPECT_LT(states_of_spline.col(samples - 1).tail<3>().cwiseProduct(Eigen::Vector3d(1, dt, dt * dt)).norm(), round_off);
}

}  // namespace
}  // namespace unrig
