// Second moments and torsion constants against closed forms, their limits (thin wall, solid), and a numerical solution of Saint-Venant's torsion.

#include "core/rig/cross_section.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/rig/beam_flexibility.h"

namespace unrig {
namespace {

using std::numbers::pi;

TEST(CrossSection, OfATubeIsTheRingsIntegral) {
  // Int r^2 dA over the ring, by the midpoint rule in r: 2 pi r^3 dr.
  const double outer = 0.04, wall = 0.002;
  double area = 0, polar = 0;
  constexpr int rings = 4000;
  for (int k = 0; k < rings; ++k) {
    const double dr = wall / rings, r = outer / 2 - wall + (k + 0.5) * dr;
    area += 2 * pi * r * dr;
    polar += 2 * pi * r * r * r * dr;
  }
  const CrossSection tube = tube_section(outer, wall);
  EXPECT_NEAR(tube.area, area, 1e-9 * area);
  EXPECT_NEAR(tube.polar_second_moment, polar, 1e-7 * polar);
  EXPECT_NEAR(tube.second_moment, polar / 2, 1e-7 * polar);
  EXPECT_DOUBLE_EQ(tube.torsion_constant, tube.polar_second_moment);
}

TEST(CrossSection, OfATubeGoesToTheThinRingAndToTheSolidBar) {
  const double d = 0.05, thin = 1e-6 * d;
  const CrossSection ring = tube_section(d + thin, thin);  // mean diameter d: I = pi d^3 t / 8, J = pi d^3 t / 4
  EXPECT_NEAR(ring.second_moment, pi * d * d * d * thin / 8, 1e-9 * ring.second_moment);
  EXPECT_NEAR(ring.torsion_constant, pi * d * d * d * thin / 4, 1e-9 * ring.torsion_constant);
  const CrossSection nearly_solid = tube_section(d, d / 2 * (1 - 1e-5)), solid = circular_section(d);
  EXPECT_NEAR(nearly_solid.area, solid.area, 1e-9 * solid.area);
  EXPECT_NEAR(nearly_solid.torsion_constant, solid.torsion_constant, 1e-9 * solid.torsion_constant);
  EXPECT_DOUBLE_EQ(solid.torsion_constant, circular_torsion_constant(d));
}

TEST(CrossSection, OfARectangleBendsAlongItsHeight) {
  const CrossSection upright = rectangular_section(0.03, 0.01), flat = rectangular_section(0.01, 0.03);
  EXPECT_DOUBLE_EQ(upright.second_moment, 0.01 * 2.7e-5 / 12);
  EXPECT_NEAR(upright.second_moment / flat.second_moment, 9, 1e-12);
  EXPECT_DOUBLE_EQ(upright.torsion_constant, flat.torsion_constant);
  EXPECT_DOUBLE_EQ(upright.polar_second_moment, upright.second_moment + flat.second_moment);
}

TEST(CrossSection, OfABoxGoesToTheThinWallAndToTheSolidBar) {
  const double h = 0.04, b = 0.06, thin = 1e-6;
  const CrossSection box = box_section(h + thin, b + thin, thin);  // mid-wall h by b
  const double bredt = 2 * thin * h * h * b * b / (h + b);
  EXPECT_NEAR(box.torsion_constant, bredt, 1e-7 * bredt);
  EXPECT_NEAR(box.second_moment, thin * (h * h * h / 6 + b * h * h / 2), 1e-4 * box.second_moment);
  EXPECT_NEAR(box.area, 2 * thin * (h + b), 1e-9 * box.area);
  const CrossSection full = box_section(h, b, h / 2 * (1 - 1e-6)), solid = rectangular_section(h, b);
  EXPECT_NEAR(full.second_moment, solid.second_moment, 1e-9 * solid.second_moment);
  EXPECT_NEAR(full.polar_second_moment, solid.polar_second_moment, 1e-7 * solid.polar_second_moment);
  EXPECT_NEAR(full.torsion_constant, solid.torsion_constant, 0.06 * solid.torsion_constant);
}

/// J = 2 Int phi dA of Prandtl's stress function, laplacian(phi) = -2, phi = 0 outside, constant in the hole (Timoshenko and Goodier, 3rd ed., sections 104 and 115), by
/// finite volumes: `height` by `width` cells of unit size, walls of `wall` cells.
double prandtl_torsion_constant(int height, int width, int wall) {
  const auto number = [&](int i, int j) {  // 0: the hole, all of it one unknown; -1: the outer edge
    if (i <= 0 || j <= 0 || i >= height || j >= width) return -1;
    return i >= wall && j >= wall && i <= height - wall && j <= width - wall ? 0 : 1 + i * (width + 1) + j;
  };
  const int unknowns = 1 + (height + 1) * (width + 1);
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(unknowns), diagonal = Eigen::VectorXd::Zero(unknowns);
  for (int i = 1; i < height; ++i)
    for (int j = 1; j < width; ++j) {
      const int here = number(i, j);
      load[here] += 2;
      for (const int there : {number(i + 1, j), number(i - 1, j), number(i, j + 1), number(i, j - 1)}) {
        if (there == here) continue;
        diagonal[here] += 1;
        if (there >= 0) entries.emplace_back(here, there, -1);
      }
    }
  for (int k = 0; k < unknowns; ++k) entries.emplace_back(k, k, diagonal[k] > 0 ? diagonal[k] : 1);
  Eigen::SparseMatrix<double> equations(unknowns, unknowns);
  equations.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd phi = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(equations).solve(load);
  return phi.dot(load);
}

TEST(CrossSection, OfABoxComesNearTheExactTorsionConstant) {
  EXPECT_NEAR(prandtl_torsion_constant(100, 100, 50) / rectangular_torsion_constant(100, 100), 1, 1e-3) << "the numerical solution itself";
  for (const auto& [height, width] : {std::pair{96, 96}, {96, 192}, {96, 384}})
    for (const int wall : {8, 12, 16, 24, 32, 40, 48}) {
      const double exact = prandtl_torsion_constant(height, width, wall), formula = box_section(height, width, wall - 1e-9).torsion_constant;
      EXPECT_NEAR(formula / exact, 1, 0.065) << height << " by " << width << ", wall " << wall;
    }
}

TEST(CrossSection, WhatIsNone) {
  EXPECT_THROW(circular_section(0), std::invalid_argument);
  EXPECT_THROW(tube_section(0.04, 0), std::invalid_argument);
  EXPECT_THROW(tube_section(0.04, 0.02), std::invalid_argument);
  EXPECT_THROW(rectangular_section(0.01, -1), std::invalid_argument);
  EXPECT_THROW(box_section(0.04, 0.02, 0.01), std::invalid_argument);
  EXPECT_THROW(box_section(0.04, std::numeric_limits<double>::quiet_NaN(), 0.001), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
