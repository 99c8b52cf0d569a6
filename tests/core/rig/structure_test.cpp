#include "core/rig/structure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double length = 2, stiffness = 50, mass = 3;  // m, N m^2, kg

/// A uniform cantilever of that many equal lumps, each in the middle of its element; Euler and Bernoulli's flexibility in closed form.
Chain cantilever(Index elements) {
  Chain chain;
  chain.inertia = VectorXd::Constant(elements, mass / static_cast<double>(elements));
  chain.flexibility.resize(elements, elements);
  for (Index i = 0; i < elements; ++i)
    for (Index j = 0; j < elements; ++j) {
      const double step = length / static_cast<double>(elements);
      const double near = step * (static_cast<double>(std::min(i, j)) + 0.5), far = step * (static_cast<double>(std::max(i, j)) + 0.5);
      chain.flexibility(i, j) = near * near * (3 * far - near) / (6 * stiffness);
    }
  return chain;
}

/// A uniform shaft, clamped and free: omega = (2k - 1) pi / 2 sqrt(GJ / (I' L^2)).
Chain shaft(Index elements) {
  Chain chain;
  chain.inertia = VectorXd::Constant(elements, mass / static_cast<double>(elements));
  chain.flexibility.resize(elements, elements);
  for (Index i = 0; i < elements; ++i)
    for (Index j = 0; j < elements; ++j)
      chain.flexibility(i, j) = length / static_cast<double>(elements) * (static_cast<double>(std::min(i, j)) + 0.5) / stiffness;
  return chain;
}

/// The first three roots of cos x cosh x = -1.
constexpr double euler_bernoulli[] = {1.8751040687119611, 4.6940911329741746, 7.8547574382376126};

TEST(ChainModes, OfAUniformCantileverConvergeToEulerAndBernoulli) {
  const double unit = std::sqrt(stiffness / (mass / length) / std::pow(length, 4));
  for (Index mode = 0; mode < 3; ++mode) {
    const double exact = euler_bernoulli[mode] * euler_bernoulli[mode] * unit;
    const double coarse = chain_modes(cantilever(20)).omega[mode] / exact - 1, fine = chain_modes(cantilever(40)).omega[mode] / exact - 1;
    EXPECT_NEAR(std::log2(coarse / fine), 2, 0.05) << "lumps in the middle of elements are the midpoint rule; mode " << mode + 1;
    EXPECT_LT(std::abs(fine), 0.01) << "mode " << mode + 1;
  }
}

TEST(ChainModes, OfAUniformShaftConvergeToTheWaveEquation) {
  const double unit = std::sqrt(stiffness / mass / length);
  for (Index mode = 0; mode < 3; ++mode) {
    const double exact = (static_cast<double>(mode) + 0.5) * pi * unit;
    const double coarse = chain_modes(shaft(20)).omega[mode] / exact - 1, fine = chain_modes(shaft(40)).omega[mode] / exact - 1;
    EXPECT_NEAR(std::log2(coarse / fine), 2, 0.05) << "mode " << mode + 1;
    EXPECT_LT(std::abs(fine), 0.01) << "mode " << mode + 1;
  }
}

TEST(ChainModes, AreOrthonormalAndSolveTheEigenproblem) {
  const Chain chain = cantilever(12);
  const Modes modes = chain_modes(chain);
  ASSERT_EQ(modes.omega.size(), 12);
  const MatrixXd gram = modes.shape.transpose() * chain.inertia.asDiagonal() * modes.shape;
  EXPECT_LT((gram - MatrixXd::Identity(12, 12)).norm(), 1e-12);
  for (Index k = 0; k < 12; ++k) {
    const VectorXd left = chain.flexibility * chain.inertia.asDiagonal() * modes.shape.col(k);  // seed, Eq. 3.3a
    const VectorXd right = modes.shape.col(k) / (modes.omega[k] * modes.omega[k]);
    EXPECT_LT((left - right).norm(), 1e-12 * (chain.flexibility * chain.inertia.asDiagonal()).norm()) << k;
    EXPECT_GT(modes.omega[k], k > 0 ? modes.omega[k - 1] : 0.0);
    EXPECT_GT(modes.shape(11, k), 0) << "the tip moves towards positive force";
  }
}

TEST(ChainModes, RoundingNoiseOfAPrintedMatrixIsNoMode) {
  Chain chain = cantilever(6);
  const MatrixXd good = chain.flexibility;
  chain.flexibility = good * 1e6;
  chain.flexibility = (chain.flexibility.array() / 100).round().matrix() * 100 / 1e6;  // two or three digits are left
  const Modes modes = chain_modes(chain);
  EXPECT_LT(modes.omega.size(), 6);
  EXPECT_GE(modes.omega.size(), 1);
  EXPECT_TRUE(modes.omega.allFinite());
  chain.flexibility = good;
  EXPECT_NEAR(modes.omega[0] / chain_modes(chain).omega[0], 1, 0.01);
}

// ---------------------------------------------------------------------------------------------------------------- basis

const Rig& seed_rig() {
  static const Rig rig = read_rig(test::null_campaign("rig.toml"));
  return rig;
}

TEST(Basis, ExtendsTheTwistOverTheRigidPart) {
  const Rig& rig = seed_rig();
  const Basis basis = make_basis(rig, Index{3}, Index{2});
  ASSERT_EQ(basis.size(), 5);
  const Modes torsion = chain_modes(rig.torsion);
  for (Index i = 0; i < rig.station.size(); ++i) {
    const Index carrier = std::min<Index>(i, rig.rigid_from - 1);
    EXPECT_EQ(basis.twist.row(i).tail(2), torsion.shape.row(carrier).head(2)) << i;
    EXPECT_EQ(basis.twist.row(i).head(3).norm(), 0);
    EXPECT_EQ(basis.normal.row(i).tail(2).norm(), 0);
  }
  EXPECT_EQ(basis.torsion_chain.rightCols(2), torsion.shape.leftCols(2));
  EXPECT_EQ(basis.torsion_chain.leftCols(3).norm(), 0);
  const MatrixXd generalised = basis.torsion_chain.transpose() * rig.torsion.inertia.asDiagonal() * basis.torsion_chain;
  EXPECT_LT((generalised.bottomRightCorner(2, 2) - MatrixXd::Identity(2, 2)).norm(), 1e-12);
}

TEST(Basis, RefusesMoreModesThanThereAre) {
  EXPECT_THROW(make_basis(seed_rig(), Index{100}, Index{1}), std::invalid_argument);
  EXPECT_THROW(make_basis(seed_rig(), Index{1}, Index{100}), std::invalid_argument);
}

TEST(Basis, ANumberOfModesIsTakenAsItStands) {
  Rig rig = seed_rig();
  rig.normal.modes = 2;
  rig.torsion.modes = 1;
  const Basis basis = make_basis(rig, 250.0, 998.2);
  EXPECT_EQ(basis.normal_modes, 2);
  EXPECT_EQ(basis.torsion_modes, 1);
}

TEST(Basis, AllMeansEveryModeBelowNyquistAndWhatItTakesToConverge) {
  Rig rig = seed_rig();
  rig.normal.modes = 0;
  rig.torsion.modes = 1;
  const Index every = chain_modes(rig.normal).omega.size();
  for (const double nyquist : {10.0, 50.0, 250.0}) {
    const Basis basis = make_basis(rig, nyquist, 998.2);
    const VectorXd dry = chain_modes(rig.normal).omega / (2 * pi);
    EXPECT_GE(basis.normal_modes, (dry.array() < nyquist).count()) << nyquist;
    EXPECT_LE(basis.normal_modes, every);
    // One more mode moves nothing below Nyquist by more than a thousandth, unless there is none.
    if (basis.normal_modes == every) continue;
    const VectorXd here = coupled_frequencies(rig, basis, 998.2), richer = coupled_frequencies(rig, make_basis(rig, basis.normal_modes + 1, Index{1}), 998.2);
    for (Index i = 0; i < here.size() && richer[i] < nyquist; ++i) EXPECT_NEAR(here[i] / richer[i], 1, 1e-3) << nyquist << " Hz, mode " << i + 1;
  }
  // In vacuum the modes are the frequencies: none is needed beyond Nyquist but the one that shows it, save for the coupling to torsion.
  EXPECT_LE(make_basis(rig, 50.0, 0.0).normal_modes, 3);
}

TEST(CoupledFrequencies, FallWithTheFluidAndConvergeFromAbove) {
  const Rig& rig = seed_rig();
  const VectorXd thin = coupled_frequencies(rig, make_basis(rig, Index{2}, Index{1}), 998.2), rich = coupled_frequencies(rig, make_basis(rig, Index{6}, Index{1}), 998.2);
  const VectorXd dry = coupled_frequencies(rig, make_basis(rig, Index{6}, Index{1}), 0), heavy = coupled_frequencies(rig, make_basis(rig, Index{6}, Index{1}), 998.2, 1.5);
  for (Index i = 0; i < 3; ++i) EXPECT_GE(thin[i], rich[i]) << "Rayleigh and Ritz: fewer modes are stiffer";
  for (Index i = 0; i < 7; ++i) {
    EXPECT_LT(rich[i], dry[i]);
    EXPECT_LT(heavy[i], rich[i]);
  }
}

}  // namespace
}  // namespace unrig
