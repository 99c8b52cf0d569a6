// The exact propagator of core/propagate/exact_step.h against an integrator that knows nothing of matrix exponentials, and its derivatives against
// differences; both judged by their slope: halve the step and expect the order.

#include <gtest/gtest.h>

#include <cmath>

#include "core/propagate/exact_step.h"
#include "core/propagate/response.h"
#include "tests/verification/seed.h"

namespace unrig::seed {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double dt = 0.002;  // s

/// Everything at once: towed, pitched, pushed and shaken.
Conditions all_inputs() {
  Conditions conditions = towed();
  conditions.force = conditions.mount = true;
  return conditions;
}

VectorXd some_state(Index n) {
  VectorXd state(n);
  for (Index i = 0; i < n; ++i) state[i] = std::cos(1.3 * static_cast<double>(i) + 0.2);
  return state;
}

/// Three inputs, and second derivatives that bend them by as much as they are.
VectorXd some_inputs(double size) {
  VectorXd u = size * some_state(6);
  u.tail(3) /= dt * dt;
  return u;
}

/// Classical Runge-Kutta for x' = A x + J jerk + B u. The first half of u are cubics over the step, the second half their second derivatives, straight.
VectorXd runge_kutta(const LinearSystem& system, VectorXd x, double jerk, const VectorXd& u0, const VectorXd& u1, int steps) {
  const double h = dt / steps;
  const auto slope = [&](double t, const VectorXd& state) {
    const double s = t / dt;
    VectorXd u = u0 + s * (u1 - u0);
    u.head(3) += dt * dt * (-s / 3 + s * s / 2 - s * s * s / 6) * u0.tail(3) + dt * dt * (s * s * s - s) / 6 * u1.tail(3);
    VectorXd d = system.A.value * state + system.B.value * u;
    d[system.motion + 2] += jerk;
    return d;
  };
  for (int k = 0; k < steps; ++k) {
    const double t = h * k;
    const VectorXd a = slope(t, x), b = slope(t + h / 2, x + h / 2 * a), c = slope(t + h / 2, x + h / 2 * b), d = slope(t + h, x + h * c);
    x += h / 6 * (a + 2 * b + 2 * c + d);
  }
  return x;
}

TEST(Propagator, IsTheLimitOfRungeKutta) {
  const AeroelasticModel model = seed::model(rig(), 3, 1, wagner(Wagner::within_1e4));
  const LinearSystem system = model.system(all_inputs(), model.start_values(), {});
  const ExactStep step = exact_step(system, dt);
  const VectorXd start = some_state(system.states()), u0 = some_inputs(1), u1 = some_inputs(-2);
  const double jerk = 40;
  const VectorXd exact = step.transition.value * start + jerk * step.jerk.value + step.input0.value * u0 + step.input1.value * u1;
  double last = 0;
  for (const int steps : {16, 32, 64, 128}) {  // 133 Hz times 2 ms is 1.7 rad: 0.1 rad per step and finer
    const VectorXd x = runge_kutta(system, start, jerk, u0, u1, steps);
    const double error = (x - exact).norm() / exact.norm();
    if (last > 0) {
      EXPECT_NEAR(last / error, 16, 1.5) << steps << " steps: fourth order";
    }
    last = error;
  }
  EXPECT_LT(last, 1e-9) << "and the limit is the propagator";
}

TEST(Propagator, TwoHalfStepsAreOneStep) {
  const AeroelasticModel model = seed::model(rig(), 5, 2, wagner(Wagner::within_1e6));
  const LinearSystem system = model.system(all_inputs(), model.start_values(), {});
  const MatrixXd whole = exact_step(system, dt).transition.value, half = exact_step(system, dt / 2).transition.value;
  EXPECT_LT((half * half - whole).norm() / whole.norm(), 1e-12) << "round-off";
}

/// All that depends on theta in one step, in a row.
struct Blocks {
  std::vector<MatrixXd> value;
  std::vector<std::vector<MatrixXd>> partial;
};

Blocks blocks_at(const AeroelasticModel& model, const VectorXd& theta) {
  const LinearSystem system = model.system(all_inputs(), theta, {"gauge"});
  const ExactStep step = exact_step(system, dt);
  Blocks blocks;
  for (const DualMatrix* m : {&step.transition, &step.jerk, &step.input0, &step.input1, &system.C, &system.D}) {
    blocks.value.push_back(m->value);
    std::vector<MatrixXd> partial;
    for (Index j = 0; j < theta.size(); ++j) partial.push_back(m->depends_on(j) ? m->d(j) : MatrixXd::Zero(m->rows(), m->cols()));
    blocks.partial.push_back(partial);
  }
  return blocks;
}

TEST(Propagator, PartialDerivativesAreTheLimitOfDifferences) {
  const AeroelasticModel model = seed::model(rig(), 3, 1, wagner(Wagner::jones));
  VectorXd theta = model.start_values();
  theta[model.index("normal.stiffness_scale")] = 0.9;
  const Blocks exact = blocks_at(model, theta);
  const char* names[] = {"transition", "jerk", "input0", "input1", "C", "D"};
  for (Index j = 0; j < theta.size(); ++j) {
    const auto central = [&](double h, std::size_t block) -> MatrixXd {
      VectorXd up = theta, down = theta;
      up[j] += h, down[j] -= h;
      return (blocks_at(model, up).value[block] - blocks_at(model, down).value[block]) / (2 * h);
    };
    for (std::size_t block = 0; block < exact.value.size(); ++block) {
      const MatrixXd& derivative = exact.partial[block][static_cast<std::size_t>(j)];
      const double h = 0.04 * std::max(theta[j], 0.1), size = derivative.norm();
      const double coarse = (central(h, block) - derivative).norm(), fine = (central(h / 2, block) - derivative).norm();
      const double round_off = 1e-11 * exact.value[block].norm() / h;
      const std::string where = std::string(names[block]) + " by " + model.parameters()[static_cast<std::size_t>(j)].name;
      // Order two: a quarter; a derivative that is linear in theta (the slope in C, say) leaves nothing but round-off.
      if (coarse > 100 * round_off) {
        EXPECT_NEAR(coarse / fine, 4, 0.1) << where;
      }
      EXPECT_LE(fine, 1e-2 * size + 100 * round_off) << where;
    }
  }
}

TEST(Propagator, ResponseCarriesTheSameDerivatives) {
  // The gauge of a whole step run by theta, through drive(): a fit sees these.
  const AeroelasticModel model = seed::model(rig(), 2, 1, wagner(Wagner::jones));
  const SampledMotion sampled = step_motion();
  const Index samples = 600;
  const VectorXd theta = model.start_values(), jerk = sampled.motion.jerk.head(samples);
  const auto gauge = [&](const VectorXd& at, Partials partials) {
    const LinearSystem system = model.system(towed(), at, {"gauge"});
    return drive(system, exact_step(system, sampled.dt), DualMatrix(MatrixXd::Zero(system.states(), 1), at.size()), samples, jerk, {},
                 partials);
  };
  const Response exact = gauge(theta, Partials::all);
  for (Index j = 0; j < theta.size(); ++j) {
    const VectorXd derivative = exact.partial[static_cast<std::size_t>(j)].col(0);
    const auto error = [&](double h) {
      VectorXd up = theta, down = theta;
      up[j] += h, down[j] -= h;
      return ((gauge(up, Partials::none).output - gauge(down, Partials::none).output).col(0) / (2 * h) - derivative).norm() /
             derivative.norm();
    };
    const double h = 0.01 * std::max(theta[j], 0.1), coarse = error(h), fine = error(h / 2);
    if (coarse > 1e-8) {
      EXPECT_NEAR(coarse / fine, 4, 0.1) << model.parameters()[static_cast<std::size_t>(j)].name;
    }
    EXPECT_LT(fine, 0.01) << model.parameters()[static_cast<std::size_t>(j)].name;
  }
}

}  // namespace
}  // namespace unrig::seed
