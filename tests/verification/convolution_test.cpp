// The convolution of Eq. 2.9 by quadrature, against the lags that unrig carries as states; and superposition, on which both rest (Eq. 2.8).

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/propagate/exact_step.h"
#include "core/run/motion.h"
#include "core/model/rigid_system.h"
#include "tests/verification/seed.h"

namespace unrig::seed {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using std::numbers::pi;

// Gauss-Legendre with four nodes on [0, 1]: exact for polynomials of degree 7.
constexpr std::array node{0.069431844202973714, 0.33000947820757187, 0.66999052179242813, 0.93056815579702629};
constexpr std::array weight{0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693};

/// Angle rate and acceleration between the samples of a spline.
struct Between {
  double rate, acceleration;
};
Between between(const Motion& m, double dt, Index k, double fraction) {
  const double t = fraction * dt;
  return {m.rate[k] + t * (m.acceleration[k] + 0.5 * t * m.jerk[k]), m.acceleration[k] + t * m.jerk[k]};
}

/// 2 pi b rho U l Int phi(U (t - t')/b) dw/dt' dt' at sample `last`, for a rigid rig: dw/dt = U p' + b p'' about the quarter chord.
template <typename Phi>
double convolution(const Phi& phi, const Motion& m, double dt, Index last) {
  const Conditions c = towed();
  const double b = semichord * 0.0254, l = span * 0.0254;
  double sum = 0;
  for (Index k = 0; k < last; ++k) {
    for (std::size_t g = 0; g < node.size(); ++g) {
      const Between p = between(m, dt, k, node[g]);
      const double since = dt * (static_cast<double>(last - k) - node[g]);
      sum += weight[g] * dt * phi(c.speed * since / b) * (c.speed * p.rate + b * p.acceleration);
    }
  }
  return 2 * pi * b * c.density * c.speed * l * sum;
}

TEST(Convolution, OfTheRigidRigIsItsLags) {
  const auto [angle, dt, motion] = step_motion();
  for (const Wagner which : {Wagner::jones, Wagner::within_1e6}) {
    const IndicialFunction phi = wagner(which);
    const AeroelasticModel model = seed::model(rig(), 1, 1, phi);
    const VectorXd states = motion_response(rigid_system(model, towed(), undamped(model)), motion, dt).col(0);
    for (const Index k : {205, 220, 240, 400, 1500, 3200})
      EXPECT_NEAR(states[k] / convolution(phi, motion, dt, k), 1, 1e-11)
          << "round-off of 3200 steps; quadrature is exact to 1e-16 here, sample " << k;
  }
}

TEST(Convolution, WithWagnersOwnFunctionIsMetWithinTheApproximation) {
  const auto [angle, dt, motion] = step_motion();
  const AeroelasticModel model = seed::model(rig(), 1, 1, wagner(Wagner::within_1e4));
  const VectorXd states = motion_response(rigid_system(model, towed(), undamped(model)), motion, dt).col(0);
  // An error of at most 9.66e-5 in phi, times the total variation of w: U 1.3 deg steadily, and twice 0.3 U for the rate that comes and
  // goes.
  const double variation = towed().speed * (1.3 * degree + 2 * 0.3);
  const double bound = 9.66e-5 * 2 * pi * semichord * 0.0254 * towed().density * towed().speed * span * 0.0254 * variation;
  for (const Index k : {205, 220, 240, 400, 1500, 3200})
    EXPECT_NEAR(states[k], convolution(wagner_exact, motion, dt, k), bound) << "sample " << k;
}

/// Largest difference between a strip's circulation from its lags and from Eq. 2.9 with the downwash that the coupled rig itself makes,
/// over the largest circulation; Simpson's rule with steps of dt.
double coupled_error(int refine) {
  const auto [angle, dt, coarse] = step_motion();
  const IndicialFunction phi = wagner(Wagner::jones);
  const AeroelasticModel model = seed::model(rig(), 3, 1, phi);
  const LinearSystem system = model.system(towed(), undamped(model), {});
  const double b = semichord * 0.0254;
  const Index parts = 2 * refine, first = 195, steps = 200, n = 4, strips = 3;  // from just before the onset
  const ExactStep step = exact_step(system, dt / static_cast<double>(parts));

  double largest = 0, error = 0;
  for (const Index strip : {Index{0}, Index{2}}) {
    const Index element = model.rig().submerged[static_cast<std::size_t>(strip)] - 1;
    RowVectorXd w = RowVectorXd::Zero(system.states());
    w.head(n) = towed().speed * model.basis().twist.row(element);
    w.segment(n, n) = b * model.basis().twist.row(element) - model.basis().normal.row(element);
    w[system.motion] = towed().speed;
    w[system.motion + 1] = b;
    RowVectorXd force = 0.5 * w;
    for (Index j = 0; j < 2; ++j) force[2 * n + j * strips + strip] += phi.amplitude[j];

    VectorXd state = VectorXd::Zero(system.states());
    std::vector<double> rate;  // dw/dt at every part of a step
    for (Index k = first; k < first + steps; ++k) {
      for (Index part = 0; part < parts; ++part) {
        rate.push_back(w * (system.A.value * state));
        state = step.transition.value * state + coarse.jerk[k] * step.jerk.value.col(0);
      }
      if ((k - first) % 20 != 19) continue;
      const auto count = static_cast<Index>(rate.size());
      const double h = dt / static_cast<double>(parts), last = w * (system.A.value * state);
      double sum = 0;
      for (Index i = 0; i <= count; ++i) {
        const double simpson = (i == 0 || i == count ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) * h / 3;
        sum +=
            simpson * phi(towed().speed * h * static_cast<double>(count - i) / b) * (i == count ? last : rate[static_cast<std::size_t>(i)]);
      }
      const double circulation = force * state;
      largest = std::max(largest, std::abs(circulation));
      error = std::max(error, std::abs(circulation - sum));
    }
  }
  return error / largest;
}

TEST(Convolution, OfTheCoupledRigIsItsLags) {
  const double error = coupled_error(1), halved = coupled_error(2);
  EXPECT_LT(error, 6e-7) << "Simpson's rule at 71 Hz and 0.25 ms; measured, rounded up";
  EXPECT_NEAR(error / halved, 16, 2) << "its order is four: what differs is the quadrature";
}

// ------------------------------------------------------------------------------------------------ Duhamel

class Duhamel : public testing::Test {
 protected:
  Duhamel()
      : model_(seed::model(rig(), 3, 1, wagner(Wagner::jones))),
        system_(model_.system(towed(), undamped(model_), {"gauge", "tip_displacement", "tip_twist"})) {}
  MatrixXd response(const VectorXd& angle) const { return motion_response(system_, interpolated_motion(angle, dt_), dt_); }

  AeroelasticModel model_;
  LinearSystem system_;
  double dt_ = 0.0005;
};

TEST_F(Duhamel, SumsScaleAndShift) {
  const VectorXd a = step_motion().motion.angle;
  VectorXd later = VectorXd::Zero(a.size());
  later.tail(a.size() - 300) = a.head(a.size() - 300);
  const MatrixXd once = response(a), shifted = response(later), both = response(2 * a - 0.5 * later);
  const RowVectorXd size = both.cwiseAbs().colwise().maxCoeff();
  for (Index c = 0; c < 3; ++c) {
    EXPECT_LT((both - (2 * once - 0.5 * shifted)).col(c).cwiseAbs().maxCoeff() / size[c], 1e-10)
        << system_.outputs[static_cast<std::size_t>(c)];
    // A spline rings for a few samples before its first knot that moves (0.27 per sample): 300 samples later or not is round-off.
    EXPECT_LT((shifted.bottomRows(a.size() - 300) - once.topRows(a.size() - 300)).col(c).cwiseAbs().maxCoeff() / size[c], 1e-10);
  }
}

TEST_F(Duhamel, AnyMotionIsAnIntegralOverIdealSteps) {
  // y(t) = Int h(t - t') p'(t') dt' + impulse p' + doublet p'', h the smooth part of the ideal step: Eq. 2.8 for the whole rig. Tests the
  // delta functions of core/model/ideal_step.h, which no record can show.
  const Motion motion = step_motion().motion;
  const MatrixXd direct = motion_response(system_, motion, dt_);
  const IdealStep step = ideal_step(system_, 1);
  for (const Index last : {202, 215, 236, 300, 700}) {
    VectorXd sum = VectorXd::Zero(3);
    for (Index k = 190; k < std::min<Index>(last, 260); ++k) {  // the shaft moves from sample 200 to 236
      for (std::size_t g = 0; g < node.size(); ++g) {
        const double since = dt_ * (static_cast<double>(last - k) - node[g]);
        sum += weight[g] * dt_ * between(motion, dt_, k, node[g]).rate * step.output_at(since);
      }
    }
    sum += step.output.impulse * motion.rate[last] + step.output.doublet * motion.acceleration[last];
    for (Index c = 0; c < 3; ++c) {
      const double size = direct.col(c).cwiseAbs().maxCoeff();
      EXPECT_NEAR(sum[c] / size, direct(last, c) / size, 1e-10) << system_.outputs[static_cast<std::size_t>(c)] << " at sample " << last
                                                                << "; round-off and the spline's ringing before sample 190, 0.27^10";
    }
  }
}

}  // namespace
}  // namespace unrig::seed
